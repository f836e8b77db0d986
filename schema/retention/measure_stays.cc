// SPDX-License-Identifier: Apache-2.0
// Which stays go, and which lose their beginning, or the room or place that they were in.
#include <algorithm>
#include <map>

#include "schema/base/status.h"
#include "schema/retention/measure.h"

namespace dsg {
namespace {

class StayMeasurer {
 public:
  StayMeasurer(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
               Measured* measured)
      : map_(map), index_(index), stop_(stop), measured_(*measured) {
    for (const TrackInfo& track : index.tracks()) track_of_[track.agent] = &track;
  }

  absl::Status Run() {
    DSG_RETURN_IF_ERROR(OfAgents());
    DSG_RETURN_IF_ERROR(InNodes());
    for (const auto& [key, stay] : edits_) {
      if (stay.place.empty() && stay.room.empty()) removals_.push_back(key);
    }
    std::sort(removals_.begin(), removals_.end());
    removals_.erase(std::unique(removals_.begin(), removals_.end()), removals_.end());
    for (const auto& [key, stay] : edits_) {
      if (!std::binary_search(removals_.begin(), removals_.end(), key)) {
        measured_.stay_edits.push_back({key, stay});
      }
    }
    measured_.stay_removals = removals_;
    measured_.amount.stay_count += static_cast<int64_t>(removals_.size());
    measured_.amount.stay_edit_count += static_cast<int64_t>(measured_.stay_edits.size());
    return absl::OkStatus();
  }

 private:
  bool IsGone(NodeId id) const {
    if (id.empty()) return false;
    const int64_t at = index_.Find(id);
    return at >= 0 && measured_.selection.is_gone[static_cast<size_t>(at)];
  }

  absl::Status OfAgents() {
    for (const TrackChoice& choice : measured_.selection.tracks) {
      if (choice.stays_until_ns == kTimeMin) continue;
      DSG_RETURN_IF_ERROR(RemoveOf(choice.agent, choice.stays_until_ns));
    }
    for (const TrackInfo& track : index_.tracks()) {
      if (IsGone(track.agent)) DSG_RETURN_IF_ERROR(RemoveOf(track.agent, kTimeMax));
    }
    return absl::OkStatus();
  }

  absl::Status RemoveOf(NodeId agent, TimeNs until_ns) {
    DSG_RETURN_IF_ERROR(AskStop(stop_));
    DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                         map_.StaysOfAgent(agent, kTimeMin, until_ns));
    for (const Stay& stay : stays) {
      const StayKey key{agent, stay.enter_ns};
      if (stay.exit_ns <= until_ns) {
        removals_.push_back(key);
      } else if (stay.enter_ns < until_ns) {
        // Its end is as readers are shown it: where the track ends, at the latest.
        edits_[key] = stay;
        edits_[key].enter_ns = until_ns;
      }
    }
    return absl::OkStatus();
  }

  absl::Status InNodes() {
    for (size_t i = 0; i < index_.nodes().size(); ++i) {
      const IndexedNode& node = index_.nodes()[i];
      if (!node.may_hold_stays || !measured_.selection.is_gone[i]) continue;
      DSG_ASSIGN_OR_RETURN(const std::vector<Stay> stays,
                           map_.StaysInNode(node.id, kTimeMin, kTimeMax, stop_));
      for (const Stay& stay : stays) Clear(stay);
    }
    return absl::OkStatus();
  }

  void Clear(const Stay& shown) {
    const auto [edit, is_new] = edits_.try_emplace({shown.agent, shown.enter_ns}, shown);
    Stay& stay = edit->second;
    const auto track = track_of_.find(stay.agent);
    if (is_new && track != track_of_.end()) stay = WithOpenEnd(stay, *track->second);
    if (IsGone(stay.place)) stay.place = NodeId();
    if (IsGone(stay.room)) stay.room = NodeId();
  }

  const Snapshot& map_;
  const GraphIndex& index_;
  const StopCheck& stop_;
  Measured& measured_;
  std::map<NodeId, const TrackInfo*> track_of_;
  std::vector<StayKey> removals_;
  std::map<StayKey, Stay> edits_;
};

}  // namespace

Stay WithOpenEnd(Stay stay, const TrackInfo& track) {
  // How readers are shown a stay that nobody was seen to leave.
  const bool was_clipped =
      track.pose_count > 0 && stay.exit_ns == std::max(stay.enter_ns, track.last_ns) + 1;
  if (was_clipped) stay.exit_ns = kTimeMax;
  return stay;
}

absl::Status MeasureStays(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                          Measured* measured) {
  return StayMeasurer(map, index, stop, measured).Run();
}

}  // namespace dsg
