// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/merge/known_pairs.h"
#include "schema/merge/merge_graph.h"
#include "schema/merge/mesh_probe.h"
#include "schema/merge/origins.h"
#include "schema/merge/plan_check.h"
#include "schema/merge/track_history.h"
#include "schema/merge/vocabulary.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

// Beyond this one of the maps has not z up, or the transform is wrong.
constexpr double kTiltMaxRad = 0.1;

absl::Status CheckTransform(const Pose3d& map_T_other) {
  if (!IsValidPose(map_T_other)) {
    return MakeError(Reason::kFieldInvalid,
                     "the transform between the maps is none: its numbers must be finite and its "
                     "quaternion a unit one",
                     {{"field", "map_t_other"}});
  }
  const double tilt = TiltOf(map_T_other);
  if (tilt <= kTiltMaxRad) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrFormat("the transform between the maps tilts by %.1f degrees; z is up in all maps, "
                      "so it may turn about z, and tilt by %.1f degrees at most",
                      tilt * 180.0 / std::numbers::pi, kTiltMaxRad * 180.0 / std::numbers::pi),
      {{"field", "map_t_other"}});
}

const char* NameOf(Clock clock) {
  switch (clock) {
    case Clock::kUnix:
      return "UNIX";
    case Clock::kPtpTai:
      return "PTP_TAI";
    case Clock::kMonotonic:
      return "MONOTONIC";
  }
  return "unknown";
}

void Count(NodeId id, UsedIds* used) {
  uint64_t& largest = (*used)[id.letter()];
  largest = std::max(largest, id.index());
}

absl::Status CountNodesAt(MapReader* map, Revision revision, const StopCheck& stop, UsedIds* used) {
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot, map->At(revision));
  return snapshot->ReadAllNodes(stop, [&](const Node& node) { Count(node.id, used); });
}

// What this merge has written and others have retired since does not come again.
void LeaveOutRetired(const Written& written, const MapContent& mine, MapContent* theirs) {
  const auto is_retired = [&](NodeId id) {
    const auto found = written.nodes.find(id);
    return found != written.nodes.end() && mine.IndexOf(found->second) < 0;
  };
  std::erase_if(theirs->nodes, [&](const Node& node) { return is_retired(node.id); });
  std::erase_if(theirs->edges, [&](const Edge& edge) {
    return is_retired(edge.source) || is_retired(edge.target);
  });
  std::erase_if(theirs->tracks, [&](const TrackInfo& track) { return is_retired(track.agent); });
  theirs->Index();
}

// Others may have taken the origins off.
void PairWritten(const Written& written, const MapContent& mine, const MapContent& theirs,
                 std::vector<int>* pair_of) {
  for (const auto& [theirs_id, mine_id] : written.nodes) {
    const int index = theirs.IndexOf(theirs_id);
    if (index >= 0) (*pair_of)[static_cast<size_t>(index)] = mine.IndexOf(mine_id);
  }
}

void ListCopiedAgents(const MapContent& mine, const MapContent& theirs, const KnownPairs& known,
                      const TrackHistory& tracks, MergePlan* plan) {
  for (const int agent : theirs.OfClass(NodeClass::kAgent)) {
    const std::optional<Origin>& origin = known.origin_of[static_cast<size_t>(agent)];
    if (!origin.has_value() || !origin->is_copy) continue;
    const int index = known.pair_of[static_cast<size_t>(agent)];
    if (index < 0) continue;
    const NodeId id = mine.nodes[static_cast<size_t>(index)].id;
    plan->copied_agents.insert(id);
    const auto bases = tracks.bases.find(agent);
    if (bases != tracks.bases.end()) plan->track_bases[id] = bases->second;
  }
}

absl::StatusOr<SessionChanges> ChangesOf(const MapContent& mine, const MapContent& theirs,
                                         const std::vector<int>& pair_of, const Snapshot& other,
                                         const Pose3d& map_T_other, const MergeOptions& options,
                                         const StopCheck& stop) {
  if (!options.find_changes) return SessionChanges();
  MeshProbe mesh(other, map_T_other);
  const auto probe = [&](const Pose3d& map_T_box, const Box3d& box, double slack_m) {
    return mesh.Look(map_T_box, box, slack_m);
  };
  return FindChanges(mine, theirs, pair_of, options.change, probe, stop);
}

}  // namespace

absl::StatusOr<UsedIds> FindUsedIds(MapReader* map, const StopCheck& stop) {
  UsedIds used;
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
  DSG_ASSIGN_OR_RETURN(const Revision oldest, map->OldestRevision());
  DSG_RETURN_IF_ERROR(CountNodesAt(map, oldest, stop, &used));
  if (oldest < head.revision) {
    DSG_ASSIGN_OR_RETURN(const Touched touched, map->TouchedBetween(oldest, head.revision, stop));
    for (const NodeId id : touched.nodes) Count(id, &used);
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map->Tags());
  for (const Tag& tag : tags) {
    if (tag.revision < oldest) DSG_RETURN_IF_ERROR(CountNodesAt(map, tag.revision, stop, &used));
  }
  return used;
}

absl::Status CheckMergeable(const Snapshot& into, const Snapshot& other) {
  const MapSpec& mine = into.spec();
  const MapSpec& theirs = other.spec();
  if (mine.name == theirs.name) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("map \"", mine.name, "\" cannot be merged with itself; name another map"),
        {{"field", "other"}, {"map", mine.name}});
  }
  if (mine.clock == theirs.clock) return absl::OkStatus();
  return MakeError(
      Reason::kFramesIncompatible,
      absl::StrCat("map \"", mine.name, "\" is on the clock ", NameOf(mine.clock), " and map \"",
                   theirs.name, "\" on ", NameOf(theirs.clock),
                   "; their times cannot be compared, so ingest one of the logs again"),
      {{"map", mine.name}, {"other", theirs.name}});
}

std::optional<Pose3d> TransformOfLastMerge(const MapContent& into, const MapContent& other) {
  std::vector<Pose3d> transforms;
  for (const Node& node : into.nodes) {
    const auto copy = CopiedFrom(node);
    if (!copy.has_value() || copy->map != other.spec.name) continue;
    const int index = other.IndexOf(copy->id);
    if (index < 0) continue;
    const bool is_other = !HoldsNow(*copy, other).value_or(true);
    if (is_other || !IsAsWritten(node, *copy)) continue;
    const Node& theirs = other.nodes[static_cast<size_t>(index)];
    Pose3d transform = node.map_T_node * theirs.map_T_node.Inverse();
    transform.orientation.normalize();
    transforms.push_back(transform);
  }
  // Copies that moved in a later revision of the other map disagree, each in its own way.
  const auto agreeing = [&](const Pose3d& pose) {
    return std::count_if(transforms.begin(), transforms.end(), [&](const Pose3d& each) {
      return (each.position - pose.position).norm() < 0.01 &&
             AngleBetween(each.orientation, pose.orientation) < 0.001;
    });
  };
  const size_t tried = std::min<size_t>(transforms.size(), 20);
  for (size_t i = 0; i < tried; ++i) {
    if (agreeing(transforms[i]) * 2 > static_cast<int64_t>(transforms.size())) {
      return transforms[i];
    }
  }
  return std::nullopt;
}

absl::StatusOr<MergePlan> PlanMerge(const Snapshot& into, const Snapshot& other,
                                    const Pose3d& map_T_other, const MergeOptions& options,
                                    const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(CheckMergeable(into, other));
  DSG_RETURN_IF_ERROR(CheckTransform(map_T_other));
  DSG_ASSIGN_OR_RETURN(const MapContent mine, ReadContent(into, stop));
  DSG_ASSIGN_OR_RETURN(MapContent theirs, ReadContent(other, stop));
  DSG_ASSIGN_OR_RETURN(const Vocabulary vocabulary, JoinVocabularies(mine, theirs));
  LeaveOutRetired(options.written, mine, &theirs);
  const std::optional<Pose3d> before = TransformOfLastMerge(mine, theirs);
  DSG_ASSIGN_OR_RETURN(KnownPairs known,
                       FindKnownPairs(mine, theirs, options.into_map, options.other_map, stop));
  PairWritten(options.written, mine, theirs, &known.pair_of);
  Adopt(map_T_other, vocabulary, &theirs);
  if (options.check_reach) {
    DSG_RETURN_IF_ERROR(CheckReach(mine.spec, other, theirs, map_T_other, stop));
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<int> pair_of,
                       MatchNodes(mine, theirs, known.pair_of, options.match, stop));
  DSG_ASSIGN_OR_RETURN(const SessionChanges changes,
                       ChangesOf(mine, theirs, pair_of, other, map_T_other, options, stop));
  MergePlan plan;
  plan.into_name = mine.spec.name;
  plan.other_name = theirs.spec.name;
  plan.into_revision = mine.revision;
  plan.other_revision = theirs.revision;
  plan.map_T_other = map_T_other;
  // By now the other map lies in the frame of this one.
  plan.evidence = EvidenceFor(mine, theirs, Pose3d(), {});
  plan.map_T_other_before = before.value_or(map_T_other);
  plan.mesh = options.mesh;
  plan.batch_row_count = options.batch_row_count;
  plan.graph.layers = vocabulary.new_layers;
  plan.graph.labels = vocabulary.new_labels;
  for (const auto& [theirs_id, mine_id] : vocabulary.class_of) {
    if (theirs_id >= 0 && mine_id >= 0) {
      plan.class_of[static_cast<uint32_t>(theirs_id)] = static_cast<uint32_t>(mine_id);
    }
  }
  DSG_ASSIGN_OR_RETURN(const TrackHistory tracks,
                       ReadTrackHistory(theirs, known, other, options.other_map, stop));
  ListCopiedAgents(mine, theirs, known, tracks, &plan);
  DSG_RETURN_IF_ERROR(BuildGraph(mine, theirs, {pair_of, known, changes, tracks}, options, &plan));
  DSG_RETURN_IF_ERROR(CheckGraph(mine, &plan));
  return plan;
}

}  // namespace dsg::merge
