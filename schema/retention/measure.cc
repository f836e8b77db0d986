// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/measure.h"

#include <algorithm>
#include <map>

#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/retention/simplify.h"

namespace dsg {
namespace {

// Dropped poses closer than this form one stretch, which loses all its factors.
constexpr TimeNs kStretchNs = 120 * kNsPerSecond;

// Looks up ascending times in ascending spans.
class SpanWalk {
 public:
  explicit SpanWalk(const std::vector<Interval>& spans) : spans_(spans) {}
  bool Holds(TimeNs time_ns) {
    while (next_ < spans_.size() && spans_[next_].to_ns <= time_ns) ++next_;
    return next_ < spans_.size() && spans_[next_].Contains(time_ns);
  }

 private:
  const std::vector<Interval>& spans_;
  size_t next_ = 0;
};

class TrackMeasurer {
 public:
  TrackMeasurer(const Snapshot& map, const TrackInfo& track, const TrackChoice& choice,
                const StopCheck& stop, Measured* measured)
      : map_(map), track_(track), choice_(choice), stop_(stop), measured_(*measured) {}

  absl::Status Run(std::set<Sha256>* topologies) {
    plan_.agent = choice_.agent;
    plan_.forgotten = choice_.forgotten;
    DSG_RETURN_IF_ERROR(Forget(topologies));
    for (const Thinning& thinning : choice_.thinnings) DSG_RETURN_IF_ERROR(Thin(thinning));
    if (!plan_.thinned_ns.empty()) DSG_RETURN_IF_ERROR(CountThinned());
    LeaveLastPose();
    const bool is_needed = pose_count_ > 0 || !plan_.thinned_ns.empty() ||
                           !plan_.shape_spans.empty() || !plan_.factor_spans.empty();
    if (is_needed) measured_.tracks.push_back(std::move(plan_));
    return absl::OkStatus();
  }

 private:
  absl::Status Forget(std::set<Sha256>* topologies) {
    for (const Interval& span : plan_.forgotten) {
      PoseBytes bytes(map_.spec().codec);
      DSG_RETURN_IF_ERROR(
          map_.ReadPoses(track_.agent, span.from_ns, span.to_ns, stop_, [&](const TimedPose& pose) {
            bytes.Add(pose);
            ++pose_count_;
            return true;
          }));
      bytes.FlushTo(&measured_.amount);
      Amount batches;
      std::vector<Sha256> found;
      DSG_RETURN_IF_ERROR(CountBatches(map_, track_.agent, span, stop_, &batches, &found));
      if (batches.shape_count > 0) plan_.shape_spans.push_back(span);
      if (batches.factor_count > 0) plan_.factor_spans.push_back(span);
      measured_.amount += batches;
      topologies->insert(found.begin(), found.end());
    }
    measured_.forgotten_pose_count += pose_count_;
    return absl::OkStatus();
  }

  // The last pose of a removed agent goes with its node, so that an interrupted prune still knows
  // when the agent was seen last.
  void LeaveLastPose() {
    const bool is_all = plan_.forgotten.size() == 1 && plan_.forgotten[0] == Interval();
    if (is_all && track_.pose_count > 0) plan_.forgotten[0].to_ns = track_.last_ns;
  }

  // Thins what forgetting and earlier thinnings left.
  absl::Status Thin(const Thinning& thinning) {
    SimplifyOptions options;
    options.position_m = thinning.position_m;
    options.rotation_rad = thinning.rotation_rad;
    options.gap_ns_max = track_.gap_ns_max;
    if (!thinning.ends_are_fixed) options.span = thinning.span;
    std::vector<TimeNs> dropped_ns;
    TrackThinner thinner(options,
                         [&](const TimedPose& pose) { dropped_ns.push_back(pose.time_ns); });
    SpanWalk forgotten(plan_.forgotten);
    size_t gone = 0;
    DSG_RETURN_IF_ERROR(
        map_.ReadPoses(track_.agent, thinning.ends_are_fixed ? thinning.span.from_ns : kTimeMin,
                       thinning.span.to_ns, stop_, [&](const TimedPose& pose) {
                         if (forgotten.Holds(pose.time_ns)) {
                           thinner.Break();
                           return true;
                         }
                         const auto& thinned = plan_.thinned_ns;
                         while (gone < thinned.size() && thinned[gone] < pose.time_ns) ++gone;
                         if (gone == thinned.size() || thinned[gone] != pose.time_ns)
                           thinner.Add(pose);
                         return true;
                       }));
    thinner.Finish(/*is_whole=*/thinning.ends_are_fixed || track_.last_ns < thinning.span.to_ns);
    std::vector<TimeNs> both;
    std::merge(plan_.thinned_ns.begin(), plan_.thinned_ns.end(), dropped_ns.begin(),
               dropped_ns.end(), std::back_inserter(both));
    plan_.thinned_ns = std::move(both);
    return absl::OkStatus();
  }

  absl::Status CountThinned() {
    const std::vector<TimeNs>& thinned = plan_.thinned_ns;
    PoseBytes before(map_.spec().codec);
    PoseBytes after(map_.spec().codec);
    SpanWalk forgotten(plan_.forgotten);
    size_t gone = 0;
    DSG_RETURN_IF_ERROR(map_.ReadPoses(
        track_.agent, thinned.front(), thinned.back() + 1, stop_, [&](const TimedPose& pose) {
          if (forgotten.Holds(pose.time_ns)) return true;
          before.Add(pose);
          if (gone < thinned.size() && thinned[gone] == pose.time_ns) {
            ++gone;
          } else {
            after.Add(pose);
          }
          return true;
        }));
    Amount whole;
    Amount left;
    before.FlushTo(&whole);
    after.FlushTo(&left);
    measured_.amount.pose_count += whole.pose_count - left.pose_count;
    measured_.amount.byte_count += std::max<int64_t>(whole.byte_count - left.byte_count, 0);
    return CountFactors();
  }

  // Factors of a thinned stretch refer to poses that do not exist any more.
  absl::Status CountFactors() {
    std::vector<Interval> stretches;
    for (const TimeNs time_ns : plan_.thinned_ns) {
      if (stretches.empty() || time_ns - stretches.back().to_ns > kStretchNs) {
        stretches.push_back({time_ns, time_ns + 1});
      }
      stretches.back().to_ns = time_ns + 1;
    }
    for (const Interval& stretch : stretches) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors,
                           map_.Factors(track_.agent, stretch.from_ns, stretch.to_ns));
      std::erase_if(factors, [&](const PoseFactor& factor) {
        return !HasEndIn(factor, track_.agent, stretch);
      });
      if (factors.empty()) continue;
      plan_.factor_spans.push_back(stretch);
      measured_.amount.factor_count += static_cast<int64_t>(factors.size());
      measured_.amount.byte_count += BytesOf(factors);
    }
    plan_.factor_spans = JoinIntervals(std::move(plan_.factor_spans));
    return absl::OkStatus();
  }

  const Snapshot& map_;
  const TrackInfo& track_;
  const TrackChoice& choice_;
  const StopCheck& stop_;
  Measured& measured_;
  TrackPlan plan_;
  int64_t pose_count_ = 0;
};

// Also collects the topologies of removed shapes.
absl::Status MeasureTracks(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                           Measured* measured, std::set<Sha256>* topologies) {
  const std::vector<TrackChoice>& choices = measured->selection.tracks;
  for (const TrackInfo& track : index.tracks()) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const auto chosen =
        std::find_if(choices.begin(), choices.end(),
                     [&](const TrackChoice& choice) { return choice.agent == track.agent; });
    TrackChoice choice;
    if (chosen != choices.end()) choice = *chosen;
    choice.agent = track.agent;
    const int64_t at = index.Find(track.agent);
    if (at >= 0 && measured->selection.is_gone[static_cast<size_t>(at)]) {
      choice.forgotten = {Interval()};
    }
    if (choice.forgotten.empty() && choice.thinnings.empty()) continue;
    DSG_RETURN_IF_ERROR(TrackMeasurer(map, track, choice, stop, measured).Run(topologies));
  }
  return absl::OkStatus();
}

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
        // The end is the one that readers see, at most the end of the track.
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

absl::Status MeasureStays(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                          Measured* measured) {
  return StayMeasurer(map, index, stop, measured).Run();
}

// Counts edges in one pass for all selections.
absl::Status MeasureEdges(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                          std::vector<Measured>* all) {
  std::vector<uint32_t> position(index.nodes().size());
  for (uint32_t i = 0; i < index.bottom_up().size(); ++i) position[index.bottom_up()[i]] = i;
  for (Measured& one : *all) one.edge_counts.assign(index.nodes().size(), 0);
  // An edge that a concurrent commit replaces may count twice, which is acceptable for reports and
  // sizes.
  return map.ReadAllEdges(stop, [&](const Edge& edge) {
    const int64_t source = index.Find(edge.source);
    const int64_t target = index.Find(edge.target);
    if (source < 0 || target < 0) return;
    for (Measured& one : *all) {
      const bool source_goes = one.selection.is_gone[static_cast<size_t>(source)];
      const bool target_goes = one.selection.is_gone[static_cast<size_t>(target)];
      if (!source_goes && !target_goes) continue;
      uint32_t first = position[static_cast<size_t>(source_goes ? source : target)];
      if (source_goes && target_goes) {
        first = std::min(first, position[static_cast<size_t>(target)]);
      }
      ++one.edge_counts[first];
      ++one.amount.edge_count;
      one.amount.byte_count += static_cast<int64_t>(EncodeEdgePayload(edge).size());
    }
  });
}

void MeasureNodes(const GraphIndex& index, Measured* measured) {
  for (size_t i = 0; i < index.nodes().size(); ++i) {
    if (!measured->selection.is_gone[i]) continue;
    ++measured->amount.node_count;
    measured->amount.byte_count += index.nodes()[i].byte_count;
  }
}

absl::Status MeasureMesh(const Snapshot& map, const StopCheck& stop, Measured* measured) {
  const Selection& selection = measured->selection;
  if (!selection.all_mesh && selection.solids.empty()) return absl::OkStatus();
  measured->mesh.solids = selection.solids;
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, map.MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, map.ReadMeshBlock(index));
    if (!selection.all_mesh && !MayTouch(block, selection.solids)) continue;
    bool is_cut = true;
    MeshBlock rest;
    if (!selection.all_mesh) rest = CutMesh(block, selection.solids, &is_cut);
    if (!is_cut) continue;
    ++measured->amount.mesh_block_count;
    auto byte_count = static_cast<int64_t>(EncodeMeshBlock(block).size());
    if (rest.positions_map.empty()) {
      measured->mesh.removed.push_back(index);
    } else {
      measured->mesh.cut.push_back(index);
      byte_count -= static_cast<int64_t>(EncodeMeshBlock(rest).size());
    }
    measured->amount.byte_count += std::max<int64_t>(byte_count, 0);
  }
  return absl::OkStatus();
}

// Removes topologies that remaining shapes use.
absl::Status DropKeptTopologies(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                                const Measured& measured, std::set<Sha256>* assets) {
  for (const TrackInfo& track : index.tracks()) {
    const auto plan = std::find_if(measured.tracks.begin(), measured.tracks.end(),
                                   [&](const TrackPlan& one) { return one.agent == track.agent; });
    const auto goes = [&](TimeNs time_ns) {
      return plan != measured.tracks.end() &&
             std::any_of(plan->forgotten.begin(), plan->forgotten.end(),
                         [&](const Interval& span) { return span.Contains(time_ns); });
    };
    DSG_RETURN_IF_ERROR(map.ReadShapes(track.agent, kTimeMin, kTimeMax, /*with_vertices=*/false,
                                       stop, [&](const ShownShape& shown) {
                                         if (shown.topology.has_value() &&
                                             !goes(shown.shape.time_ns)) {
                                           assets->erase(*shown.topology);
                                         }
                                         return !assets->empty();
                                       }));
  }
  return absl::OkStatus();
}

// Counts assets to which only removed nodes and shapes refer.
absl::Status MeasureAssets(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                           std::set<Sha256> assets, Measured* measured) {
  const bool has_topologies = !assets.empty();
  const auto& is_gone = measured->selection.is_gone;
  const auto is_left = [&](const IndexedAsset& asset) {
    return !is_gone[static_cast<size_t>(index.Find(asset.node))];
  };
  for (const IndexedAsset& asset : index.assets()) {
    if (!is_left(asset)) assets.insert(asset.sha256);
  }
  if (assets.empty()) return absl::OkStatus();
  for (const IndexedAsset& asset : index.assets()) {
    if (is_left(asset)) assets.erase(asset.sha256);
  }
  if (has_topologies) {
    DSG_RETURN_IF_ERROR(DropKeptTopologies(map, index, stop, *measured, &assets));
  }
  for (const Sha256& sha256 : assets) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const Asset asset, map.ReadAsset(sha256));
    ++measured->amount.asset_count;
    measured->amount.byte_count += static_cast<int64_t>(asset.content.size());
  }
  return absl::OkStatus();
}

}  // namespace

Stay WithOpenEnd(Stay stay, const TrackInfo& track) {
  // Readers see a stay without an end clipped to the end of the track.
  const bool was_clipped =
      track.pose_count > 0 && stay.exit_ns == std::max(stay.enter_ns, track.last_ns) + 1;
  if (was_clipped) stay.exit_ns = kTimeMax;
  return stay;
}

absl::Status Measure(const Snapshot& map, const GraphIndex& index, const StopCheck& stop,
                     std::vector<Measured>* all) {
  DSG_RETURN_IF_ERROR(MeasureEdges(map, index, stop, all));
  for (Measured& one : *all) {
    MeasureNodes(index, &one);
    std::set<Sha256> topologies;
    DSG_RETURN_IF_ERROR(MeasureTracks(map, index, stop, &one, &topologies));
    DSG_RETURN_IF_ERROR(MeasureStays(map, index, stop, &one));
    DSG_RETURN_IF_ERROR(MeasureMesh(map, stop, &one));
    DSG_RETURN_IF_ERROR(MeasureAssets(map, index, stop, std::move(topologies), &one));
  }
  return absl::OkStatus();
}

}  // namespace dsg
