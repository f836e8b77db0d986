// SPDX-License-Identifier: Apache-2.0
#include "query/engine/walk_area_cache.h"

#include <utility>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Tells apart what was made at the same address one after the other.
template <typename T>
bool IsSame(const std::weak_ptr<const T>& kept, const std::shared_ptr<const T>& wanted) {
  return !kept.owner_before(wanted) && !wanted.owner_before(kept);
}

}  // namespace

std::shared_ptr<const WalkArea> WalkAreaCache::FindArea(
    const std::shared_ptr<const GraphView>& view, const WalkTile& tile, TimeNs at_ns) {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->tile != tile || !entry->area->valid.Contains(at_ns) || !IsSame(entry->view, view)) {
      continue;
    }
    ++stats_.hit_count;
    entries_.splice(entries_.begin(), entries_, entry);
    return entry->area;
  }
  return nullptr;
}

std::shared_ptr<const WalkGrounds> WalkAreaCache::FindGrounds(
    const std::shared_ptr<const PlaceGraph>& places, const WalkTile& tile, TimeNs at_ns) const {
  const std::lock_guard lock(mutex_);
  for (const Entry& entry : entries_) {
    if (entry.tile == tile && entry.grounds->valid.Contains(at_ns) &&
        IsSame(entry.places, places)) {
      return entry.grounds;
    }
  }
  return nullptr;
}

void WalkAreaCache::Insert(Entry entry) {
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [this](const Entry& kept) {
    if (!kept.places.expired() && !kept.view.expired()) return false;
    stats_.bytes -= kept.bytes;
    return true;
  });
  stats_.bytes += entry.bytes;
  entries_.push_front(std::move(entry));
  // The newest stays, however large: it is in use anyway.
  while (stats_.bytes > bytes_max_ && entries_.size() > 1) {
    stats_.bytes -= entries_.back().bytes;
    entries_.pop_back();
  }
}

absl::StatusOr<std::shared_ptr<const WalkArea>> WalkAreaCache::Get(
    const std::shared_ptr<const GraphView>& view, const Eigen::Vector3d& position_map,
    double reach_m, TimeNs at_ns, const StopCheck& stop) {
  const WalkTile tile = TileOf(position_map, reach_m);
  if (std::shared_ptr<const WalkArea> kept = FindArea(view, tile, at_ns)) return kept;
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const PlaceGraph> places, view->Places(stop));
  std::shared_ptr<const WalkGrounds> grounds = FindGrounds(places, tile, at_ns);
  const bool is_shared = grounds != nullptr;
  if (!is_shared) {
    DSG_ASSIGN_OR_RETURN(WalkGrounds made, MakeWalkGrounds(*places, tile, at_ns, stop));
    grounds = std::make_shared<const WalkGrounds>(std::move(made));
  }
  DSG_ASSIGN_OR_RETURN(WalkArea made, MakeWalkArea(*view, *places, *grounds, tile, at_ns, stop));
  const auto area = std::make_shared<const WalkArea>(std::move(made));
  const size_t bytes =
      area->memory_bytes() + sizeof(Entry) + grounds->places.capacity() * sizeof(PlaceIndex);
  Insert({view, places, tile, grounds, area, bytes});
  const std::lock_guard lock(mutex_);
  ++stats_.made_count;
  stats_.shared_count += is_shared ? 1 : 0;
  return area;
}

WalkAreaCache::Stats WalkAreaCache::stats() const {
  const std::lock_guard lock(mutex_);
  Stats stats = stats_;
  stats.area_count = static_cast<int64_t>(entries_.size());
  return stats;
}

}  // namespace dsg::query
