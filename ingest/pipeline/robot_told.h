// SPDX-License-Identifier: Apache-2.0
// The robot of a log: its poses as they were told, and the pose graph behind them.
// Refuses a second robot: a log has one body that its sensors are on.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/loop/robot_graph.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// What loop closures have done to a log, for the user.
struct LoopCounts {
  int64_t loop_count = 0;
  int64_t kept_count = 0;
  /// Outside the robot's trajectory.
  int64_t unusable_count = 0;
  /// By how much the trajectory has moved at most, metres.
  double largest_m = 0.0;
  /// Where those that were not believed stood: "loops.jsonl:3".
  std::vector<std::string> doubted;
};

/// Threads: one caller at a time.
class RobotTold {
 public:
  explicit RobotTold(const RobotGraphOptions& options) : graph_(options) {}

  /// Ascending in time. Poses of another robot than the first are left out.
  void AddPose(NodeId agent, const TimedPose& pose) {
    if (!poses_.empty() && agent != agent_) return;
    agent_ = agent;
    poses_.push_back(pose);
    graph_.AddPose(pose.time_ns, pose.map_T_agent);
  }
  void AddLoop(const LoopClosure& loop) {
    origins_.push_back(loop.origin);
    graph_.AddLoop(loop);
  }

  LoopCounts Count(const RobotGraph::Solution& solution) const {
    LoopCounts counts{solution.loop_count,
                      solution.kept_count,
                      solution.unusable_count,
                      solution.change.largest_m(),
                      {}};
    for (size_t i = 0; i < solution.is_kept.size(); ++i) {
      if (!solution.is_kept[i]) counts.doubted.push_back(origins_[i]);
    }
    return counts;
  }

  const RobotGraph& graph() const { return graph_; }
  NodeId agent() const { return agent_; }
  const std::vector<TimedPose>& poses() const { return poses_; }

 private:
  NodeId agent_;
  std::vector<TimedPose> poses_;
  std::vector<std::string> origins_;
  RobotGraph graph_;
};

}  // namespace dsg::ingest
