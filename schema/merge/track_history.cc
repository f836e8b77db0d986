// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/track_history.h"

#include <algorithm>

#include "schema/base/status.h"

namespace dsg::merge {
namespace {

class Reader {
 public:
  Reader(const Snapshot& other, MapReader* other_map) : other_(other), other_map_(other_map) {}

  // Null if the revision cannot be read any more.
  absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision revision) {
    std::shared_ptr<const Snapshot> none;
    if (other_map_ == nullptr) return none;
    const auto known = snapshots_.find(revision);
    if (known != snapshots_.end()) return known->second;
    auto then = other_map_->At(revision);
    if (!then.ok() && ReasonOf(then.status()) != Reason::kRevisionCompacted) return then.status();
    return snapshots_[revision] = then.ok() ? *std::move(then) : none;
  }

  // Agents whose tracks were written after a revision.
  absl::StatusOr<bool> HasChanged(NodeId agent, Revision since, const StopCheck& stop) {
    if (since == other_.revision()) return false;
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> then, At(since));
    if (then == nullptr) return true;
    auto [touched, is_new] = touched_.try_emplace(since);
    if (is_new) {
      DSG_ASSIGN_OR_RETURN(Touched all, other_map_->TouchedBetween(since, other_.revision(), stop));
      touched->second = std::move(all.tracks);
    }
    return std::binary_search(touched->second.begin(), touched->second.end(), agent);
  }

 private:
  const Snapshot& other_;
  MapReader* const other_map_;
  std::map<Revision, std::shared_ptr<const Snapshot>> snapshots_;
  std::map<Revision, std::vector<NodeId>> touched_;
};

}  // namespace

absl::StatusOr<TrackHistory> ReadTrackHistory(const MapContent& content, const KnownPairs& known,
                                              const Snapshot& other, MapReader* other_map,
                                              const StopCheck& stop) {
  TrackHistory history;
  Reader reader(other, other_map);
  for (const int agent : content.OfClass(NodeClass::kAgent)) {
    const std::optional<Origin>& origin = known.origin_of[static_cast<size_t>(agent)];
    if (!origin.has_value() || !origin->is_copy || origin->revisions.empty()) continue;
    const std::vector<Revision>& revisions = origin->revisions;
    const NodeId id = content.nodes[static_cast<size_t>(agent)].id;
    DSG_ASSIGN_OR_RETURN(const bool has_changed, reader.HasChanged(id, revisions.back(), stop));
    if (has_changed) history.changed.insert(agent);
    // Nothing to correct where only what is believed now was ever taken.
    if (!has_changed && revisions.size() == 1) continue;
    auto& bases = history.bases[agent];
    for (const Revision revision : revisions) {
      if (revision == other.revision()) {
        bases.push_back(nullptr);
        continue;
      }
      DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> then, reader.At(revision));
      if (then != nullptr) bases.push_back(std::move(then));
    }
  }
  return history;
}

}  // namespace dsg::merge
