// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/delta_builder.h"

#include <algorithm>
#include <utility>

#include "schema/base/check.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<AgentBodyOptions> kBodyFields[] = {
    {"agent-half-width", &AgentBodyOptions::human_half_width_m, 0.01, 5.0,
     "Half the width of a person of a track, metres: of adults"},
    {"agent-height", &AgentBodyOptions::human_height_m, 0.1, 5.0,
     "Height of a person of a track, metres: of adults; helmets may be worn higher"},
    {"agent-robot-half-size", &AgentBodyOptions::robot_half_size_m, 0.01, 50.0,
     "Half the size of a robot without --robot-cad, metres: a small wheeled one"},
};

}  // namespace

std::vector<BoundOption> AgentBodyOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<AgentBodyOptions>(kBodyFields, this, &bound);
  return bound;
}

Node DeltaBuilder::MakeNode(NodeId id, const PoseMeasurement& first) const {
  Node node;
  node.id = id;
  node.layer = layers::kAgents;
  node.kind = first.agent_kind;
  node.name = first.agent_name;
  node.provenance = Provenance::kPerceived;
  node.valid = {first.pose.time_ns, kTimeMax};
  node.first_observed_ns = first.pose.time_ns;
  node.agent.emplace();
  if (first.agent_kind == kinds::kHuman) {
    // A helmet may be worn higher than the usual height; the box reaches up to it.
    const double top = std::max(options_.human_height_m - feet_below_m_, 0.0);
    const double half_m = options_.human_half_width_m;
    node.box_node = {Eigen::Vector3d(-half_m, -half_m, -feet_below_m_),
                     Eigen::Vector3d(half_m, half_m, top)};
  } else {
    node.box_node = {Eigen::Vector3d::Constant(-options_.robot_half_size_m),
                     Eigen::Vector3d::Constant(options_.robot_half_size_m)};
    if (robot_model_.has_value() && first.agent_kind == kinds::kRobot) {
      SetRobotModel(*robot_model_, &node);
    }
  }
  return node;
}

void DeltaBuilder::AddPose(NodeId agent, const PoseMeasurement& measurement) {
  auto [entry, is_new] = agents_.try_emplace(agent);
  Agent& track = entry->second;
  if (is_new) track.node = MakeNode(agent, measurement);
  track.node.map_T_node = measurement.pose.map_T_agent;
  track.node.last_observed_ns = measurement.pose.time_ns;
  ++track.node.observation_count;
  track.is_stale = true;
  if (track.pending.empty()) touched_.push_back(&track);
  track.pending.push_back(measurement.pose);
  ++pose_count_;
}

const Node& DeltaBuilder::Move(NodeId agent, const Pose3d& map_T_agent) {
  const auto found = agents_.find(agent);
  DSG_CHECK(found != agents_.end());
  found->second.node.map_T_node = map_T_agent;
  return found->second.node;
}

void DeltaBuilder::Remember(NodeId agent, std::vector<Sha256> place_memory) {
  const auto found = agents_.find(agent);
  if (found == agents_.end()) return;
  found->second.node.agent->place_memory = std::move(place_memory);
  found->second.is_stale = true;
}

GraphDelta DeltaBuilder::Take(std::vector<Stay> stays) {
  GraphDelta delta;
  for (Agent* agent : touched_) {
    if (agent->is_new) {
      const bool has_model = agent->node.agent->body_model.has_value();
      if (has_model && !std::exchange(is_model_told_, true)) {
        delta.assets.push_back(robot_model_->asset);
      }
      delta.nodes.push_back(agent->node);
      agent->is_new = agent->is_stale = false;
    }
    delta.appends.push_back({agent->node.id, std::move(agent->pending)});
    agent->pending.clear();
  }
  touched_.clear();
  pose_count_ = 0;
  delta.stays = std::move(stays);
  Coalesce(&delta);
  return delta;
}

GraphDelta DeltaBuilder::TakeNodes() {
  GraphDelta delta;
  for (auto& [id, agent] : agents_) {
    if (agent.is_stale) delta.nodes.push_back(agent.node);
    agent.is_stale = false;
  }
  return delta;
}

}  // namespace dsg::ingest
