// SPDX-License-Identifier: Apache-2.0
// Folds poses into deltas. Refuses to look at the map: the same log gives the same deltas,
// whatever is stored already.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/robot_model.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Bodies of agents of which the log says positions alone.
struct AgentBodyOptions {
  double human_half_width_m = 0.25;
  double human_height_m = 1.8;
  double robot_half_size_m = 0.25;

  std::vector<BoundOption> Bind();
};

/// Threads: one caller at a time.
class DeltaBuilder {
 public:
  /// `feet_below_m`: LogInfo::feet_below_m. `robot_model`: nullopt = unknown; else its asset goes
  /// into the first delta.
  explicit DeltaBuilder(double feet_below_m, std::optional<RobotModel> robot_model = std::nullopt,
                        const AgentBodyOptions& options = {})
      : feet_below_m_(feet_below_m), robot_model_(std::move(robot_model)), options_(options) {}

  /// The first pose of an agent also makes its node.
  void AddPose(NodeId agent, const PoseMeasurement& measurement);

  /// The track of an agent that has poses ends elsewhere: its node, as it is now.
  const Node& Move(NodeId agent, const Pose3d& map_T_agent);

  /// What an agent that has poses knows places by; goes into TakeNodes.
  void Remember(NodeId agent, std::vector<Sha256> place_memory);

  /// Poses since the last Take.
  int64_t pose_count() const { return pose_count_; }
  int64_t agent_count() const { return static_cast<int64_t>(agents_.size()); }

  /// All that was added since the last call, with `stays`, coalesced. Identity is the caller's.
  GraphDelta Take(std::vector<Stay> stays);

  /// At the end of the log: what became of each agent whose node was told before its last pose
  /// (last pose, times observed), and what they remember.
  GraphDelta TakeNodes();

 private:
  struct Agent {
    Node node;
    std::vector<TimedPose> pending;
    /// Not told yet at all.
    bool is_new = true;
    /// Has poses since its node was told.
    bool is_stale = false;
  };

  Node MakeNode(NodeId id, const PoseMeasurement& first) const;

  double feet_below_m_;
  std::optional<RobotModel> robot_model_;
  AgentBodyOptions options_;
  bool is_model_told_ = false;
  int64_t pose_count_ = 0;
  /// Ascending by id, so deltas are sorted.
  std::map<NodeId, Agent> agents_;
  /// Agents with pending poses.
  std::vector<Agent*> touched_;
};

}  // namespace dsg::ingest
