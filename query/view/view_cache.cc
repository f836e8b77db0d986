// SPDX-License-Identifier: Apache-2.0
#include "query/view/view_cache.h"

#include <malloc.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "query/view/indexed_view.h"
#include "schema/base/cache.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Above this share of a map, reading what was touched one by one costs more than reading all.
constexpr double kDeriveShareMax = 0.25;
constexpr size_t kMebibyte = size_t{1} << 20;
// So much is evicted before the allocator is told to give free memory back: it takes a few
// milliseconds, and a view that is derived from another frees little.
constexpr size_t kTrimBytes = 32 * kMebibyte;

using View = std::shared_ptr<const IndexedView>;

struct MadeView {
  View view;
  bool was_derived = false;
};

// Views on their way out, freed with it: it stands before the lock, so that this happens after it.
class Evicted {
 public:
  Evicted() = default;
  Evicted(const Evicted&) = delete;
  Evicted& operator=(const Evicted&) = delete;
  ~Evicted() {
    views_.clear();
    // Each worker makes views in an arena of its own, which would keep what others cannot use.
    if (bytes_ >= kTrimBytes) malloc_trim(0);
  }

  void Add(View view) {
    bytes_ += view->fresh_bytes();
    views_.push_back(std::move(view));
  }

 private:
  std::vector<View> views_;
  size_t bytes_ = 0;
};

}  // namespace

struct ViewCache::Impl {
  struct Slot {
    View view;
    // Grows with every use.
    uint64_t last_use = 0;
    // Of its places when it was last looked at: they grow while questions fill them.
    size_t place_bytes = 0;
  };

  // The views of one open map.
  struct MapViews {
    std::shared_ptr<SymbolTable> symbols = std::make_shared<SymbolTable>();
    std::map<Revision, Slot> slots;

    // Views derived from each other share their pages: the largest counts whole, of the others only
    // what each does not share. They share their places wholly or not at all.
    size_t Bytes() const {
      size_t sum = symbols->memory_bytes();
      size_t largest = 0;
      size_t fresh_of_largest = 0;
      std::set<const SharedPlaces*> places;
      for (const auto& [revision, slot] : slots) {
        const SharedPlaces* of_view = slot.view->shared_places().get();
        if (places.insert(of_view).second) sum += of_view->memory_bytes();
        const size_t whole = slot.view->parts().memory_bytes();
        sum += slot.view->fresh_bytes();
        if (whole > largest) {
          largest = whole;
          fresh_of_largest = slot.view->fresh_bytes();
        }
      }
      return sum + largest - fresh_of_largest;
    }

    View Nearest(Revision revision) const {
      if (slots.empty()) return nullptr;
      const auto above = slots.lower_bound(revision);
      if (above == slots.begin()) return above->second.view;
      const auto below = std::prev(above);
      if (above == slots.end()) return below->second.view;
      return above->first - revision < revision - below->first ? above->second.view
                                                               : below->second.view;
    }
  };

  explicit Impl(size_t bound) : bytes_max(bound) {}

  absl::StatusOr<View> Get(const std::shared_ptr<MapReader>& map, const Snapshot& snapshot,
                           const StopCheck& stop);
  std::optional<View> Find(const std::shared_ptr<MapReader>& map, Revision revision);
  absl::StatusOr<View> MakeAndKeep(const std::shared_ptr<MapReader>& map, const Snapshot& snapshot,
                                   const StopCheck& stop);
  absl::StatusOr<MadeView> Make(MapReader* map, const Snapshot& snapshot, const View& nearest,
                                std::shared_ptr<SymbolTable> symbols, const StopCheck& stop) const;
  // Requires of these: the lock is held.
  absl::Status Keep(const std::shared_ptr<MapReader>& map, const MadeView& made, Evicted* evicted);
  void ForgetClosedMaps(Evicted* evicted);
  void EvictTo(size_t bound, const View& spared, Evicted* evicted);
  size_t Bytes() const;

  const size_t bytes_max;
  mutable std::mutex mutex;
  // By what the pointers own, so that a new map at an old address is another one.
  std::map<std::weak_ptr<MapReader>, MapViews, std::owner_less<>> maps;
  uint64_t use_count = 0;
  Stats counts;
  // Callers hold their map, so its address is its own as long as they make a view of it.
  SingleFlight<std::pair<const MapReader*, Revision>> flights;
};

size_t ViewCache::Impl::Bytes() const {
  size_t sum = 0;
  for (const auto& [map, views] : maps) sum += views.Bytes();
  return sum;
}

void ViewCache::Impl::ForgetClosedMaps(Evicted* evicted) {
  for (auto map = maps.begin(); map != maps.end();) {
    if (!map->first.expired()) {
      ++map;
      continue;
    }
    for (auto& [revision, slot] : map->second.slots) evicted->Add(std::move(slot.view));
    map = maps.erase(map);
  }
}

void ViewCache::Impl::EvictTo(size_t bound, const View& spared, Evicted* evicted) {
  while (Bytes() > bound) {
    MapViews* oldest_map = nullptr;
    std::map<Revision, Slot>::iterator oldest;
    for (auto& [map, views] : maps) {
      for (auto slot = views.slots.begin(); slot != views.slots.end(); ++slot) {
        if (slot->second.view == spared) continue;
        if (oldest_map != nullptr && slot->second.last_use > oldest->second.last_use) continue;
        oldest_map = &views;
        oldest = slot;
      }
    }
    if (oldest_map == nullptr) return;
    evicted->Add(std::move(oldest->second.view));
    oldest_map->slots.erase(oldest);
  }
}

absl::StatusOr<MadeView> ViewCache::Impl::Make(MapReader* map, const Snapshot& snapshot,
                                               const View& nearest,
                                               std::shared_ptr<SymbolTable> symbols,
                                               const StopCheck& stop) const {
  if (nearest != nullptr) {
    const Revision older = std::min(nearest->revision(), snapshot.revision());
    const Revision newer = std::max(nearest->revision(), snapshot.revision());
    const auto touched = map->TouchedBetween(older, newer, stop);
    // Where the history between the two was compacted, the whole can still be read.
    const bool is_readable = touched.ok();
    if (!is_readable && !absl::IsOutOfRange(touched.status()) &&
        !absl::IsUnimplemented(touched.status())) {
      return touched.status();
    }
    const auto all = static_cast<double>(nearest->node_count() + nearest->edge_count());
    if (is_readable && static_cast<double>(touched->nodes.size() + touched->edges.size()) <=
                           kDeriveShareMax * all) {
      DSG_ASSIGN_OR_RETURN(View view, IndexedView::Derive(*nearest, *touched, snapshot, stop));
      return MadeView{std::move(view), true};
    }
  }
  DSG_ASSIGN_OR_RETURN(View view, IndexedView::Load(snapshot, std::move(symbols), stop));
  return MadeView{std::move(view), false};
}

absl::Status ViewCache::Impl::Keep(const std::shared_ptr<MapReader>& map, const MadeView& made,
                                   Evicted* evicted) {
  ++(made.was_derived ? counts.derived_count : counts.loaded_count);
  const size_t bytes = made.view->memory_bytes();
  if (bytes > bytes_max) {
    return MakeError(
        Reason::kLimitExceeded,
        absl::StrCat("the graph of map \"", map->spec().name, "\" at revision ",
                     made.view->revision(), " takes ", bytes, " bytes in memory, more than the ",
                     bytes_max, " of the cache of graphs; ask a dsg-server that was started with ",
                     "--view-cache-mb ", bytes / kMebibyte + 1, " or more"),
        {{"map", map->spec().name}, {"bytes", absl::StrCat(bytes)}});
  }
  maps[map].slots[made.view->revision()] = {made.view, ++use_count, 0};
  ForgetClosedMaps(evicted);
  EvictTo(bytes_max, made.view, evicted);
  return absl::OkStatus();
}

std::optional<View> ViewCache::Impl::Find(const std::shared_ptr<MapReader>& map,
                                          Revision revision) {
  Evicted evicted;
  const std::lock_guard lock(mutex);
  const auto views = maps.find(map);
  if (views == maps.end()) return std::nullopt;
  const auto slot = views->second.slots.find(revision);
  if (slot == views->second.slots.end()) return std::nullopt;
  slot->second.last_use = ++use_count;
  ++counts.hit_count;
  const View view = slot->second.view;
  // Planning may have kept more beside the places since.
  const size_t place_bytes = view->shared_places()->memory_bytes();
  if (std::exchange(slot->second.place_bytes, place_bytes) < place_bytes) {
    EvictTo(bytes_max, view, &evicted);
  }
  return view;
}

absl::StatusOr<View> ViewCache::Impl::MakeAndKeep(const std::shared_ptr<MapReader>& map,
                                                  const Snapshot& snapshot, const StopCheck& stop) {
  View nearest;
  std::shared_ptr<SymbolTable> symbols;
  {
    const std::lock_guard lock(mutex);
    const MapViews& views = maps[map];
    nearest = views.Nearest(snapshot.revision());
    symbols = views.symbols;
  }
  DSG_ASSIGN_OR_RETURN(const MadeView made, Make(map.get(), snapshot, nearest, symbols, stop));
  Evicted evicted;
  const std::lock_guard lock(mutex);
  DSG_RETURN_IF_ERROR(Keep(map, made, &evicted));
  return made.view;
}

absl::StatusOr<View> ViewCache::Impl::Get(const std::shared_ptr<MapReader>& map,
                                          const Snapshot& snapshot, const StopCheck& stop) {
  return flights.Run(
      {map.get(), snapshot.revision()}, stop, [&] { return Find(map, snapshot.revision()); },
      [&] { return MakeAndKeep(map, snapshot, stop); });
}

ViewCache::ViewCache(size_t bytes_max) : impl_(std::make_unique<Impl>(bytes_max)) {}
ViewCache::~ViewCache() = default;

absl::StatusOr<std::shared_ptr<const GraphView>> ViewCache::Get(
    const std::shared_ptr<MapReader>& map, const std::shared_ptr<const Snapshot>& snapshot,
    const StopCheck& stop) {
  return impl_->Get(map, *snapshot, stop);
}

ViewCache::Stats ViewCache::stats() const {
  std::lock_guard lock(impl_->mutex);
  Stats stats = impl_->counts;
  stats.bytes = impl_->Bytes();
  for (const auto& [map, views] : impl_->maps) {
    stats.view_count += static_cast<int64_t>(views.slots.size());
  }
  return stats;
}

}  // namespace dsg::query
