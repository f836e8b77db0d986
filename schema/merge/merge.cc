// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"
#include "schema/merge/merge_graph.h"
#include "schema/merge/origins.h"
#include "schema/model/delta_check.h"
#include "schema/model/rigid_motion.h"
#include "schema/store/commit_protocol.h"

namespace dsg::merge {
namespace {

// With a larger tilt one of the maps is not z-up, or the transform is wrong.
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

// Removes nodes that this merge has written and others have retired since.
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

// Pairs by what was written, because others may have removed the origins.
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
  return FindChanges(mine, theirs, pair_of, options.change, ProbeMesh(other, map_T_other), stop);
}

absl::Status CheckPoint(const Eigen::Vector3d& at, const std::string& what) {
  if (at.allFinite() && at.cwiseAbs().maxCoeff() <= kCoordinateMaxM) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrFormat("the transform between the maps carries %s to (%.1f, %.1f, "
                                   "%.1f) m; coordinates of a map end at %.0f m, so check its "
                                   "numbers and units",
                                   what, at.x(), at.y(), at.z(), kCoordinateMaxM),
                   {{"field", "map_t_other"},
                    {"value", absl::StrCat(at.x(), ",", at.y(), ",", at.z())},
                    {"bound", absl::StrCat(kCoordinateMaxM)}});
}

absl::Status CheckNodes(const MapContent& theirs) {
  for (const Node& node : theirs.nodes) {
    const std::string what = absl::StrCat("node ", ToString(node.id));
    DSG_RETURN_IF_ERROR(CheckPoint(node.map_T_node.position, what));
    if (node.object.has_value() && node.object->model.has_value()) {
      DSG_RETURN_IF_ERROR(CheckPoint(node.object->map_T_model.position, "the model of " + what));
    }
    if (node.structure.has_value()) {
      const Eigen::Vector3d from_origin(node.structure->plane_offset_m, 0.0, 0.0);
      DSG_RETURN_IF_ERROR(CheckPoint(from_origin, "the plane of " + what));
    }
    if (!node.region.has_value()) continue;
    for (const Eigen::Vector2d& corner : node.region->footprint_map) {
      DSG_RETURN_IF_ERROR(CheckPoint({corner.x(), corner.y(), 0.0}, "a corner of " + what));
    }
  }
  return absl::OkStatus();
}

absl::Status TooFarInTime(TimeNs time_ns, const MapSpec& into, const std::string& agent) {
  return MakeError(
      Reason::kTimeOutsideMap,
      absl::StrCat("the track of ", agent, " has poses at ", time_ns,
                   " ns, more than ten years from the epoch ", into.epoch_ns, " ns of map \"",
                   into.name, "\"; ingest the log of map \"", into.name,
                   "\" again with an --epoch within ten years of both, or mend the clock of the "
                   "other log"),
      {{"map", into.name}, {"time_ns", absl::StrCat(time_ns)}});
}

absl::Status CheckTrack(const MapSpec& into, const Snapshot& other, const TrackInfo& track,
                        const Pose3d& map_T_other, const StopCheck& stop) {
  const std::string what =
      absl::StrCat("agent ", ToString(track.agent), " of map \"", other.spec().name, "\"");
  if (track.pose_count > 0) {
    for (const TimeNs time_ns : {track.first_ns, track.last_ns}) {
      // Stricter than the limit for poses, because both maps become one.
      const bool is_near = CheckTimeInMap(time_ns, into).ok() &&
                           std::abs(time_ns - into.epoch_ns) <= kObservedFarMaxNs;
      if (!is_near) return TooFarInTime(time_ns, into, what);
    }
  }
  absl::Status status;
  DSG_RETURN_IF_ERROR(
      other.ReadPoses(track.agent, kTimeMin, kTimeMax, stop, [&](const TimedPose& pose) {
        status = CheckPoint(map_T_other * pose.map_T_agent.position, "a pose of " + what);
        return status.ok();
      }));
  DSG_RETURN_IF_ERROR(status);
  DSG_ASSIGN_OR_RETURN(std::vector<PoseFactor> factors,
                       other.Factors(track.agent, kTimeMin, kTimeMax));
  for (PoseFactor& factor : factors) {
    TransformFactor(map_T_other, &factor);
    DSG_RETURN_IF_ERROR(CheckPoint(factor.relative_pose.position, "a factor of " + what));
  }
  return absl::OkStatus();
}

absl::Status CheckMesh(const Snapshot& other, const Pose3d& map_T_other, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> blocks, other.MeshBlocks());
  for (const BlockIndex& index : blocks) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const MeshBlock block, other.ReadMeshBlock(index));
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& position : block.positions_map) box.extend(position);
    if (box.isEmpty()) continue;
    const Box3d carried = TransformBox(map_T_other, box.cast<double>());
    for (const Eigen::Vector3d& corner : {carried.min(), carried.max()}) {
      DSG_RETURN_IF_ERROR(
          CheckPoint(corner, absl::StrCat("mesh block ", index.x, ",", index.y, ",", index.z)));
    }
  }
  return absl::OkStatus();
}

// Answers CheckDelta from the content in memory.
class ContentLookup final : public GraphLookup {
 public:
  explicit ContentLookup(const MapContent& content) : content_(content) {
    for (const Edge& edge : content.edges) {
      if (edge.relation != relations::kContains) continue;
      parents_[edge.target].push_back(edge.source);
      children_[edge.source].push_back(edge.target);
    }
    for (const TrackInfo& track : content.tracks) {
      if (track.pose_count > 0) track_ends_[track.agent] = track.last_ns;
    }
  }

  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override {
    const int index = content_.IndexOf(id);
    if (index < 0) return std::optional<NodeFacts>();
    const Node& node = content_.nodes[static_cast<size_t>(index)];
    return std::optional<NodeFacts>(NodeFacts{node.layer, IsAgentKind(node.kind), node.valid,
                                              node.box_node.isEmpty() ? Box3d() : node.BoxMap(),
                                              node.map_T_node.position, node.first_observed_ns,
                                              node.last_observed_ns});
  }
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override {
    for (const Layer& layer : content_.layers) {
      if (layer.id == id) return std::optional<Layer>(layer);
    }
    return std::optional<Layer>();
  }
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override {
    return Listed(parents_, id);
  }
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override {
    return Listed(children_, id);
  }
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override {
    const auto found = track_ends_.find(agent);
    return found == track_ends_.end() ? std::optional<TimeNs>() : found->second;
  }
  // Assets of the graph are written before it.
  absl::StatusOr<bool> HasAsset(const Sha256& /*sha256*/) const override { return true; }
  const MapSpec* FindSpec() const override { return &content_.spec; }
  absl::StatusOr<std::optional<Interval>> FindSpan() const override {
    std::optional<Interval> span;
    for (const TrackInfo& track : content_.tracks) {
      if (track.pose_count == 0) continue;
      if (!span.has_value()) span = {track.first_ns, track.last_ns};
      span->from_ns = std::min(span->from_ns, track.first_ns);
      span->to_ns = std::max(span->to_ns, track.last_ns);
    }
    return span;
  }

 private:
  using Family = std::map<NodeId, std::vector<NodeId>>;

  static std::vector<NodeId> Listed(const Family& family, NodeId id) {
    const auto found = family.find(id);
    return found == family.end() ? std::vector<NodeId>() : found->second;
  }

  const MapContent& content_;
  Family parents_;
  Family children_;
  std::map<NodeId, TimeNs> track_ends_;
};

// Checks that the content of the other map stays within the coordinates and times of this one.
// `theirs` is adopted (see Adopt).
// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the transform, the thing and the bound;
// OUT_OF_RANGE/TIME_OUTSIDE_MAP naming an agent; what `stop` returned.
// Cost: reads all poses and mesh blocks of the other map.
absl::Status CheckReach(const MapSpec& into, const Snapshot& other, const MapContent& theirs,
                        const Pose3d& map_T_other, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(CheckNodes(theirs));
  for (const TrackInfo& track : theirs.tracks) {
    DSG_RETURN_IF_ERROR(CheckTrack(into, other, track, map_T_other, stop));
  }
  return CheckMesh(other, map_T_other, stop);
}

// Checks that `mine` accepts the graph of a plan as one delta. Fills in its header.
// Errors: as CheckDelta.
absl::Status CheckGraph(const MapContent& mine, MergePlan* plan) {
  plan->graph.session_id = "merge";
  plan->graph.sequence = 1;
  return CheckDelta(plan->graph, ContentLookup(mine));
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
  // The other map is in the frame of this one by now.
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
