// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/forgotten.h"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

#include "absl/strings/numbers.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Ids in an error; none if it is about something else.
std::vector<NodeId> MissingNodes(const ErrorMetadata& metadata) {
  const auto found = metadata.find("missing_nodes");
  if (found == metadata.end()) return {};
  std::vector<NodeId> ids;
  std::istringstream text(found->second);
  for (std::string word; text >> word;) {
    const absl::StatusOr<NodeId> id = ParseNodeId(word);
    if (id.ok()) ids.push_back(*id);
  }
  return ids;
}

// Corrections reach over poses that were forgotten: what is left of a track bounds them.
bool MendCorrection(const ErrorMetadata& metadata, GraphDelta* delta) {
  const auto named = metadata.find("correction_of");
  if (named == metadata.end()) return false;
  const absl::StatusOr<NodeId> agent = ParseNodeId(named->second);
  if (!agent.ok()) return false;
  const auto end = metadata.find("stored_end_ns");
  TimeNs end_ns = kTimeMin;
  const bool has_end = end != metadata.end() && absl::SimpleAtoi(end->second, &end_ns);
  bool is_changed = false;
  for (TrajectoryCorrection& item : delta->corrections) {
    if (item.agent != *agent) continue;
    const auto is_after = [&](const TimedPose& pose) { return pose.time_ns > end_ns; };
    is_changed |= std::erase_if(item.poses, is_after) > 0;
  }
  if (has_end) return is_changed;
  return std::erase_if(delta->corrections, [&](const auto& item) { return item.agent == *agent; }) >
         0;
}

// All that is said of a node that is not there.
void LeaveOutNode(NodeId id, GraphDelta* delta) {
  const auto is_of = [id](const auto& item) { return item.agent == id; };
  std::erase_if(delta->retirements, [id](const Retirement& item) { return item.id == id; });
  std::erase_if(delta->edges,
                [id](const Edge& edge) { return edge.source == id || edge.target == id; });
  std::erase_if(delta->appends, is_of);
  std::erase_if(delta->corrections, is_of);
  std::erase_if(delta->factor_removals, is_of);
  std::erase_if(delta->factors, is_of);
  std::erase_if(delta->shape_removals, is_of);
  std::erase_if(delta->shapes, is_of);
  std::erase_if(delta->stays, is_of);
  for (FactorAppend& item : delta->factors) {
    std::erase_if(item.factors, [id](const PoseFactor& factor) { return factor.to_agent == id; });
  }
  std::erase_if(delta->factors, [](const FactorAppend& item) { return item.factors.empty(); });
  for (Stay& stay : delta->stays) {
    if (stay.place == id) stay.place = NodeId();
    if (stay.room == id) stay.room = NodeId();
  }
  std::erase_if(delta->stays,
                [](const Stay& stay) { return stay.place.empty() && stay.room.empty(); });
}

bool HasPosesOf(NodeId agent, const GraphDelta& delta) {
  return std::any_of(delta.appends.begin(), delta.appends.end(), [agent](const auto& item) {
    return item.agent == agent && !item.poses.empty();
  });
}

void Begin(TimeNs since_ns, int64_t pose_count, Node* node) {
  if (since_ns < node->valid.to_ns) {
    node->valid.from_ns = std::max(node->valid.from_ns, since_ns);
  }
  if (node->first_observed_ns.has_value()) {
    node->first_observed_ns = std::max(*node->first_observed_ns, since_ns);
  }
  node->observation_count = pose_count;
}

}  // namespace

void Forgotten::Observe(const GraphDelta& delta) {
  for (const Node& node : delta.nodes) {
    if (!IsAgentKind(node.kind)) continue;
    Agent& agent = agents_[node.id];
    agent.node = node;
    const std::vector<Sha256> referred = AssetsOf(node);
    for (const Asset& asset : delta.assets) {
      const auto at = std::find(referred.begin(), referred.end(), asset.sha256);
      if (at != referred.end()) agent.assets.push_back(asset);
    }
  }
}

void Forgotten::ObserveCommitted(const GraphDelta& delta) {
  Observe(delta);
  for (const Node& node : delta.nodes) {
    if (IsAgentKind(node.kind)) agents_[node.id].is_told = true;
  }
  for (const TrajectoryAppend& append : delta.appends) {
    Agent& agent = agents_[append.agent];
    agent.is_told = true;
    if (append.poses.empty()) continue;
    agent.first_told_ns = std::min(agent.first_told_ns, append.poses.front().time_ns);
  }
}

void Forgotten::ObserveTaken(const GraphDelta& delta) {
  for (const Node& node : delta.nodes) {
    if (IsAgentKind(node.kind)) agents_[node.id].is_told = true;
  }
  for (const TrajectoryAppend& append : delta.appends) {
    agents_[append.agent].pose_count += std::ssize(append.poses);
  }
}

bool Forgotten::HasReturned(NodeId agent) const {
  const auto found = agents_.find(agent);
  return found != agents_.end() && found->second.back_since_ns.has_value();
}

absl::Status Forgotten::LeaveOut(GraphDelta* delta) {
  DSG_RETURN_IF_ERROR(CompareWithMap(*delta));
  DSG_RETURN_IF_ERROR(LeaveOutGone(delta));
  for (const auto& [id, agent] : agents_) {
    if (!agent.back_since_ns.has_value()) continue;
    LeaveOutOlder(id, *agent.back_since_ns, agent.pose_count, delta);
  }
  return absl::OkStatus();
}

// A track that begins after the first pose that an earlier run had told has lost its beginning.
absl::Status Forgotten::CompareWithMap(const GraphDelta& delta) {
  std::set<NodeId> named;
  for (const Node& node : delta.nodes) named.insert(node.id);
  for (const TrajectoryAppend& item : delta.appends) named.insert(item.agent);
  for (const TrajectoryCorrection& item : delta.corrections) named.insert(item.agent);
  for (const FactorAppend& item : delta.factors) named.insert(item.agent);
  for (const ShapeAppend& item : delta.shapes) named.insert(item.agent);
  for (const Stay& stay : delta.stays) named.insert(stay.agent);
  for (const Edge& edge : delta.edges) named.insert({edge.source, edge.target});
  for (const NodeId id : named) {
    const auto found = agents_.find(id);
    if (found == agents_.end() || std::exchange(found->second.is_compared, true)) continue;
    Agent& agent = found->second;
    if (agent.first_told_ns == kTimeMax) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<TrackInfo> track, map_.FindTrack(id));
    if (!track.has_value() || track->first_ns <= agent.first_told_ns) continue;
    agent.back_since_ns = track->first_ns;
    agent.pose_count = track->pose_count;
  }
  return absl::OkStatus();
}

// A map takes news of a node that it has forgotten as a new node, so they are not sent.
absl::Status Forgotten::LeaveOutGone(GraphDelta* delta) {
  std::vector<NodeId> expected;
  for (const Node& node : delta->nodes) {
    if (!IsAgentKind(node.kind)) continue;
    DSG_ASSIGN_OR_RETURN(const bool is_expected, IsExpected(node.id));
    if (is_expected) expected.push_back(node.id);
  }
  if (expected.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::set<NodeId> there, map_.AgentsNow());
  std::vector<NodeId> missing;
  for (const NodeId id : expected) {
    if (there.contains(id)) continue;
    missing.push_back(id);
    std::erase_if(delta->nodes, [id](const Node& node) { return node.id == id; });
  }
  MendMissing(missing, delta);
  return absl::OkStatus();
}

absl::StatusOr<bool> Forgotten::IsExpected(NodeId agent) {
  const auto found = agents_.find(agent);
  if (found != agents_.end() && found->second.is_told) return true;
  DSG_ASSIGN_OR_RETURN(const std::optional<Node> stored, map_.FindNode(agent));
  return stored.has_value();
}

bool Forgotten::Mend(const absl::Status& refusal, GraphDelta* delta) {
  if (ReasonOf(refusal) != Reason::kDeltaInvalid) return false;
  const ErrorMetadata metadata = MetadataOf(refusal);
  return MendMissing(MissingNodes(metadata), delta) || MendCorrection(metadata, delta);
}

bool Forgotten::MendMissing(const std::vector<NodeId>& missing, GraphDelta* delta) {
  for (const NodeId id : missing) {
    if (!Return(id, delta)) LeaveOutNode(id, delta);
  }
  return !missing.empty();
}

bool Forgotten::Return(NodeId id, GraphDelta* delta) {
  const auto found = agents_.find(id);
  if (found == agents_.end() || !found->second.node.has_value() || !HasPosesOf(id, *delta)) {
    return false;
  }
  Agent& agent = found->second;
  const auto is_of = [id](const auto& item) { return item.agent == id; };
  const auto append = std::find_if(delta->appends.begin(), delta->appends.end(), is_of);
  const TimedPose& last = append->poses.back();
  agent.back_since_ns = append->poses.front().time_ns;
  agent.pose_count = 0;
  Node node = *agent.node;
  node.map_T_node = last.map_T_agent;
  node.last_observed_ns = last.time_ns;
  node.valid.to_ns = kTimeMax;
  Begin(*agent.back_since_ns, std::ssize(append->poses), &node);
  delta->nodes.push_back(std::move(node));
  delta->assets.insert(delta->assets.end(), agent.assets.begin(), agent.assets.end());
  std::erase_if(delta->corrections, is_of);
  LeaveOutOlder(id, *agent.back_since_ns, agent.pose_count, delta);
  return true;
}

void Forgotten::LeaveOutOlder(NodeId id, TimeNs since_ns, int64_t pose_count,
                              GraphDelta* delta) const {
  const auto is_older = [since_ns](const auto& item) { return item.time_ns < since_ns; };
  for (TrajectoryAppend& item : delta->appends) {
    if (item.agent != id) continue;
    std::erase_if(item.poses, is_older);
    pose_count += std::ssize(item.poses);
  }
  std::erase_if(delta->appends, [](const auto& item) { return item.poses.empty(); });
  for (Node& node : delta->nodes) {
    if (node.id == id) Begin(since_ns, pose_count, &node);
  }
  for (TrajectoryCorrection& item : delta->corrections) {
    if (item.agent != id) continue;
    std::erase_if(item.poses, is_older);
    item.from_ns = std::max(item.from_ns, since_ns);
  }
  std::erase_if(delta->corrections, [](const auto& item) { return item.from_ns >= item.to_ns; });
  for (FactorAppend& item : delta->factors) {
    std::erase_if(item.factors, [&](const PoseFactor& factor) {
      return (item.agent == id || factor.to_agent == id) &&
             std::min(factor.from_ns, factor.to_ns) < since_ns;
    });
  }
  std::erase_if(delta->factors, [](const auto& item) { return item.factors.empty(); });
  for (ShapeAppend& item : delta->shapes) {
    if (item.agent == id) std::erase_if(item.shapes, is_older);
  }
  std::erase_if(delta->shapes, [](const auto& item) { return item.shapes.empty(); });
  for (Stay& stay : delta->stays) {
    if (stay.agent == id) stay.enter_ns = std::max(stay.enter_ns, since_ns);
  }
  std::erase_if(delta->stays, [](const Stay& stay) { return stay.enter_ns >= stay.exit_ns; });
  for (Edge& edge : delta->edges) {
    if (edge.source == id || edge.target == id) {
      edge.valid.from_ns = std::max(edge.valid.from_ns, since_ns);
    }
  }
  std::erase_if(delta->edges, [](const Edge& e) { return e.valid.from_ns >= e.valid.to_ns; });
}

}  // namespace dsg::ingest
