// SPDX-License-Identifier: Apache-2.0
#include "query/maintenance/revert_plan.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "query/engine/diff.h"
#include "query/maintenance/revert_series.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

// Of a batch. Blocks and bodies are heavy, so that a batch has some megabytes at most.
constexpr int64_t kBatchWeightMax = 5'000;
constexpr int64_t kBlockWeight = 100;
constexpr int64_t kShapeWeight = 30;
constexpr size_t kReadBatch = 256;

// Whether parents or children may not fit any more.
bool IsElsewhere(const Node& a, const Node& b) {
  const Box3d box_a = a.BoxMap();
  const Box3d box_b = b.BoxMap();
  return a.layer != b.layer || a.map_T_node.position != b.map_T_node.position ||
         box_a.isEmpty() != box_b.isEmpty() ||
         (!box_a.isEmpty() && (box_a.min() != box_b.min() || box_a.max() != box_b.max()));
}

class Planner {
 public:
  Planner(MapReader* map, const Snapshot& present, const Snapshot& wanted, const StopCheck& stop)
      : map_(map), present_(present), wanted_(wanted), stop_(stop) {}

  absl::StatusOr<RevertPlan> Run() {
    DSG_ASSIGN_OR_RETURN(const Touched touched,
                         map_->TouchedBetween(wanted_.revision(), present_.revision(), stop_));
    DSG_RETURN_IF_ERROR(PlanNodes(touched.nodes));
    DSG_RETURN_IF_ERROR(PlanEdges(touched.edges));
    DSG_RETURN_IF_ERROR(PlanTracks(touched.tracks));
    DSG_RETURN_IF_ERROR(PlanAgents());
    DSG_RETURN_IF_ERROR(PlanBlocks(touched.mesh_blocks));
    if (touched.layers_or_labels) DSG_RETURN_IF_ERROR(PlanLabels());
    // One delta is checked as a whole; of several, each must leave the hierarchy valid.
    if (Weight() > kBatchWeightMax) DSG_RETURN_IF_ERROR(OpenHierarchy());
    Cut();
    return std::move(plan_);
  }

 private:
  struct Weighted {
    RevertStep step;
    int64_t weight;
  };

  // Of rows that come in place of others, as many as there are of both are changed, and not gone.
  void CountRows(int64_t present_count, int64_t wanted_count, int64_t Amount::*count) {
    plan_.written.*count += wanted_count;
    plan_.removed.*count += std::max<int64_t>(0, present_count - wanted_count);
  }

  void Add(std::vector<Weighted>* part, RevertStep step, int64_t weight = 1) {
    part->push_back({std::move(step), weight});
  }

  absl::Status PlanNodes(const std::vector<NodeId>& ids) {
    for (size_t from = 0; from < ids.size(); from += kReadBatch) {
      const size_t to = std::min(ids.size(), from + kReadBatch);
      const std::vector<NodeId> some(ids.begin() + static_cast<std::ptrdiff_t>(from),
                                     ids.begin() + static_cast<std::ptrdiff_t>(to));
      DSG_ASSIGN_OR_RETURN(const auto now, present_.FindNodes(some, stop_));
      DSG_ASSIGN_OR_RETURN(const auto then, wanted_.FindNodes(some, stop_));
      for (size_t i = 0; i < some.size(); ++i) PlanNode(some[i], now[i], then[i]);
    }
    return absl::OkStatus();
  }

  void PlanNode(NodeId id, const std::optional<Node>& now, const std::optional<Node>& then) {
    if (now.has_value() && then.has_value()) {
      if (SameContent(*now, *then)) return;
      if (IsElsewhere(*now, *then)) moved_.insert(id);
    }
    if (!then.has_value()) {
      if (!now.has_value()) return;
      ++plan_.removed.node_count;
      Add(&first_, RetireNode{id});
      return;
    }
    ++plan_.written.node_count;
    Add(&nodes_, WriteNode{id});
  }

  absl::Status PlanEdges(const std::vector<EdgeKey>& keys) {
    for (size_t from = 0; from < keys.size(); from += kReadBatch) {
      const size_t to = std::min(keys.size(), from + kReadBatch);
      const std::vector<EdgeKey> some(keys.begin() + static_cast<std::ptrdiff_t>(from),
                                      keys.begin() + static_cast<std::ptrdiff_t>(to));
      DSG_ASSIGN_OR_RETURN(const auto now, present_.FindEdges(some, stop_));
      DSG_ASSIGN_OR_RETURN(const auto then, wanted_.FindEdges(some, stop_));
      for (size_t i = 0; i < some.size(); ++i) PlanEdge(some[i], now[i], then[i]);
    }
    return absl::OkStatus();
  }

  void PlanEdge(const EdgeKey& key, const std::optional<Edge>& now,
                const std::optional<Edge>& then) {
    if (now.has_value() && then.has_value() && SameContent(*now, *then)) return;
    if (!then.has_value()) {
      if (!now.has_value()) return;
      ++plan_.removed.edge_count;
      Add(&first_, RemoveEdge{key});
      return;
    }
    ++plan_.written.edge_count;
    written_edges_.insert(key);
    Add(&last_, WriteEdge{key});
  }

  absl::Status PlanTracks(const std::vector<NodeId>& agents) {
    for (const NodeId agent : agents) {
      DSG_ASSIGN_OR_RETURN(const bool is_wanted, IsThere(wanted_, agent));
      DSG_ASSIGN_OR_RETURN(const auto differences,
                           FindPoseDifferences(present_, wanted_, agent, stop_));
      for (const SeriesDifference& difference : differences) {
        CountRows(difference.present_count, difference.wanted_count, &Amount::pose_count);
        // The track of an agent that is retired ends with it.
        if (!is_wanted) continue;
        Add(&last_, CorrectTrack{difference.span},
            1 + difference.present_count + difference.wanted_count);
      }
    }
    return absl::OkStatus();
  }

  static absl::StatusOr<bool> IsThere(const Snapshot& snapshot, NodeId id) {
    DSG_ASSIGN_OR_RETURN(const auto found, snapshot.FindNodes({id}, StopCheck()));
    return found.front().has_value();
  }

  absl::Status PlanAgents() {
    std::set<NodeId> agents;
    std::set<NodeId> wanted_agents;
    DSG_ASSIGN_OR_RETURN(const auto tracks_now, present_.Tracks(stop_));
    DSG_ASSIGN_OR_RETURN(const auto tracks_then, wanted_.Tracks(stop_));
    for (const TrackInfo& track : tracks_now) agents.insert(track.agent);
    for (const TrackInfo& track : tracks_then) agents.insert(track.agent);
    for (const TrackInfo& track : tracks_then) wanted_agents.insert(track.agent);
    for (const NodeId agent : agents) {
      const bool is_wanted = wanted_agents.contains(agent);
      DSG_RETURN_IF_ERROR(PlanStays(agent, is_wanted));
      DSG_RETURN_IF_ERROR(PlanFactors(agent, is_wanted));
      DSG_RETURN_IF_ERROR(PlanShapes(agent, is_wanted));
    }
    return absl::OkStatus();
  }

  absl::Status PlanStays(NodeId agent, bool is_wanted) {
    DSG_ASSIGN_OR_RETURN(const auto now, StaysOf(present_, agent));
    DSG_ASSIGN_OR_RETURN(const auto then, StaysOf(wanted_, agent));
    for (const auto& [enter_ns, stay] : now) {
      const auto same = then.find(enter_ns);
      if (same != then.end()) continue;
      ++plan_.removed.stay_count;
      if (is_wanted) Add(&first_, RemoveStay{{agent, enter_ns}});
    }
    for (const auto& [enter_ns, stay] : then) {
      const auto same = now.find(enter_ns);
      if (same != now.end() && same->second == stay) continue;
      ++plan_.written.stay_count;
      Add(&last_, WriteStay{stay});
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::map<TimeNs, Stay>> StaysOf(const Snapshot& snapshot, NodeId agent) {
    std::map<TimeNs, Stay> by_enter;
    const auto stays = snapshot.StaysOfAgent(agent, kTimeMin, kTimeMax);
    if (absl::IsNotFound(stays.status())) return by_enter;
    DSG_RETURN_IF_ERROR(stays.status());
    for (const Stay& stay : *stays) by_enter[stay.enter_ns] = stay;
    return by_enter;
  }

  absl::Status PlanFactors(NodeId agent, bool is_wanted) {
    DSG_ASSIGN_OR_RETURN(const auto now, present_.Factors(agent, kTimeMin, kTimeMax));
    DSG_ASSIGN_OR_RETURN(const auto then, wanted_.Factors(agent, kTimeMin, kTimeMax));
    if (EncodeFactors(now) == EncodeFactors(then)) return absl::OkStatus();
    CountRows(static_cast<int64_t>(now.size()), static_cast<int64_t>(then.size()),
              &Amount::factor_count);
    if (!is_wanted) return absl::OkStatus();
    Add(&last_, ReplaceFactors{agent}, static_cast<int64_t>(now.size() + then.size()));
    return absl::OkStatus();
  }

  absl::Status PlanShapes(NodeId agent, bool is_wanted) {
    DSG_ASSIGN_OR_RETURN(const auto differences,
                         FindShapeDifferences(present_, wanted_, agent, stop_));
    for (const SeriesDifference& difference : differences) {
      CountRows(difference.present_count, difference.wanted_count, &Amount::shape_count);
      if (!is_wanted) continue;
      Add(&last_, ReplaceShapes{difference.span}, kShapeWeight * (1 + difference.wanted_count));
    }
    return absl::OkStatus();
  }

  absl::Status PlanBlocks(const std::vector<BlockIndex>& indices) {
    for (const BlockIndex& index : indices) {
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      DSG_ASSIGN_OR_RETURN(const auto now, EncodedBlock(present_, index));
      DSG_ASSIGN_OR_RETURN(const auto then, EncodedBlock(wanted_, index));
      if (now == then) continue;
      if (then.has_value()) {
        ++plan_.written.mesh_block_count;
        Add(&last_, WriteBlock{index}, kBlockWeight);
      } else {
        ++plan_.removed.mesh_block_count;
        Add(&last_, RemoveBlock{index});
      }
    }
    return absl::OkStatus();
  }

  static absl::StatusOr<std::optional<std::string>> EncodedBlock(const Snapshot& snapshot,
                                                                 const BlockIndex& index) {
    const auto block = snapshot.ReadMeshBlock(index);
    if (block.ok()) return std::optional<std::string>(EncodeMeshBlock(*block));
    if (absl::IsNotFound(block.status())) return std::optional<std::string>();
    return block.status();
  }

  absl::Status PlanLabels() {
    DSG_ASSIGN_OR_RETURN(const auto now, present_.Labels());
    DSG_ASSIGN_OR_RETURN(const auto then, wanted_.Labels());
    for (const SemanticLabel& label : then) {
      if (std::find(now.begin(), now.end(), label) == now.end()) Add(&first_, WriteLabel{label});
    }
    return absl::OkStatus();
  }

  // Nodes that move come one batch after the other, so that parents and children would not fit
  // each other for a while: what holds them together is taken away first and given back at the end.
  absl::Status OpenHierarchy() {
    std::set<EdgeKey> keys;
    const auto collect = [&](const Edge& edge) {
      const EdgeKey key{edge.source, edge.relation, edge.target};
      if (!written_edges_.contains(key)) keys.insert(key);
      return true;
    };
    for (const NodeId id : moved_) {
      const EdgeFilter below{.source = id, .relation = relations::kContains};
      DSG_RETURN_IF_ERROR(wanted_.ScanEdges(below, std::nullopt, stop_, collect));
      const EdgeFilter above{.relation = relations::kContains, .target = id};
      DSG_RETURN_IF_ERROR(wanted_.ScanEdges(above, std::nullopt, stop_, collect));
    }
    for (const EdgeKey& key : keys) {
      Add(&first_, RemoveEdge{key});
      Add(&last_, WriteEdge{key});
    }
    return absl::OkStatus();
  }

  int64_t Weight() const {
    int64_t sum = 0;
    for (const auto* part : {&first_, &nodes_, &last_}) {
      for (const Weighted& item : *part) sum += item.weight;
    }
    return sum;
  }

  void Cut() {
    const bool is_one = Weight() <= kBatchWeightMax;
    int64_t used = 0;
    for (auto* part : {&first_, &nodes_, &last_}) {
      // An edge must not be taken away and given back in one delta.
      bool begins = !is_one;
      for (Weighted& item : *part) {
        const bool is_full = used > 0 && used + item.weight > kBatchWeightMax && !is_one;
        if (plan_.batches.empty() || begins || is_full) {
          plan_.batches.emplace_back();
          used = 0;
        }
        begins = false;
        used += item.weight;
        plan_.batches.back().push_back(std::move(item.step));
      }
    }
  }

  MapReader* const map_;
  const Snapshot& present_;
  const Snapshot& wanted_;
  const StopCheck& stop_;
  std::set<NodeId> moved_;
  std::set<EdgeKey> written_edges_;
  /// Edges before the nodes at their ends go, nodes before the edges that need them.
  std::vector<Weighted> first_;
  std::vector<Weighted> nodes_;
  std::vector<Weighted> last_;
  RevertPlan plan_;
};

// Fills a delta from steps.
class DeltaMaker {
 public:
  DeltaMaker(const Snapshot& present, const Snapshot& wanted, const StopCheck& stop)
      : present_(present), wanted_(wanted), stop_(stop) {}

  absl::Status operator()(const RemoveEdge& step) {
    delta_.edge_removals.push_back(step.key);
    return absl::OkStatus();
  }
  absl::Status operator()(const RemoveStay& step) {
    delta_.stay_removals.push_back(step.key);
    return absl::OkStatus();
  }
  absl::Status operator()(const RetireNode& step) {
    delta_.retirements.push_back({step.id, std::nullopt});
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteLabel& step) {
    delta_.labels.push_back(step.label);
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteNode& step) {
    DSG_ASSIGN_OR_RETURN(Node node, wanted_.GetNode(step.id));
    delta_.nodes.push_back(std::move(node));
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteEdge& step) {
    DSG_ASSIGN_OR_RETURN(auto edge, wanted_.FindEdge(step.key));
    if (edge.has_value()) delta_.edges.push_back(*std::move(edge));
    return absl::OkStatus();
  }
  absl::Status operator()(const CorrectTrack& step) {
    const bool is_quantized = wanted_.spec().codec == TrajectoryCodec::kQuantized;
    // What lies behind the end of the track is no correction of it.
    DSG_ASSIGN_OR_RETURN(const TimeNs end_ns, EndOfTrack(step.span.agent));
    const TimeNs cut_ns = end_ns == kTimeMin ? kTimeMin : end_ns + 1;
    TrajectoryCorrection correction{
        step.span.agent, step.span.from_ns, std::min(step.span.to_ns, cut_ns), {}};
    TrajectoryAppend append{step.span.agent, {}};
    DSG_RETURN_IF_ERROR(wanted_.ReadPoses(
        step.span.agent, step.span.from_ns, step.span.to_ns, stop_, [&](const TimedPose& pose) {
          auto& poses = pose.time_ns < cut_ns ? correction.poses : append.poses;
          poses.push_back(pose);
          Eigen::Quaterniond& orientation = poses.back().map_T_agent.orientation;
          if (is_quantized) orientation = StoredAsBefore(orientation);
          return true;
        }));
    if (correction.from_ns < correction.to_ns) delta_.corrections.push_back(std::move(correction));
    if (!append.poses.empty()) delta_.appends.push_back(std::move(append));
    return absl::OkStatus();
  }
  absl::Status operator()(const ReplaceFactors& step) {
    delta_.factor_removals.push_back({step.agent, kTimeMin, kTimeMax});
    DSG_ASSIGN_OR_RETURN(auto factors, wanted_.Factors(step.agent, kTimeMin, kTimeMax));
    if (!factors.empty()) delta_.factors.push_back({step.agent, std::move(factors)});
    return absl::OkStatus();
  }
  absl::Status operator()(const ReplaceShapes& step) {
    delta_.shape_removals.push_back(step.span);
    DSG_ASSIGN_OR_RETURN(auto appends, ReadShapeAppends(wanted_, step.span, stop_));
    std::move(appends.begin(), appends.end(), std::back_inserter(delta_.shapes));
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteStay& step) {
    delta_.stays.push_back(step.stay);
    return absl::OkStatus();
  }
  absl::Status operator()(const RemoveBlock& step) {
    delta_.mesh_removals.push_back(step.index);
    return absl::OkStatus();
  }
  absl::Status operator()(const WriteBlock& step) {
    DSG_ASSIGN_OR_RETURN(MeshBlock block, wanted_.ReadMeshBlock(step.index));
    delta_.mesh_blocks.push_back(std::move(block));
    return absl::OkStatus();
  }

  GraphDelta Take() { return std::move(delta_); }

 private:
  // kTimeMin for a track without poses.
  absl::StatusOr<TimeNs> EndOfTrack(NodeId agent) const {
    const auto track = present_.GetTrack(agent);
    if (absl::IsNotFound(track.status())) return kTimeMin;
    DSG_RETURN_IF_ERROR(track.status());
    return track->pose_count > 0 ? track->last_ns : kTimeMin;
  }

  const Snapshot& present_;
  const Snapshot& wanted_;
  const StopCheck& stop_;
  GraphDelta delta_;
};

}  // namespace

absl::StatusOr<RevertPlan> PlanRevert(MapReader* map, const Snapshot& present,
                                      const Snapshot& wanted, const StopCheck& stop) {
  return Planner(map, present, wanted, stop).Run();
}

absl::StatusOr<GraphDelta> MakeRevertDelta(const std::vector<RevertStep>& batch,
                                           const Snapshot& present, const Snapshot& wanted,
                                           const StopCheck& stop) {
  DeltaMaker maker(present, wanted, stop);
  for (const RevertStep& step : batch) DSG_RETURN_IF_ERROR(std::visit(maker, step));
  return maker.Take();
}

}  // namespace dsg::query
