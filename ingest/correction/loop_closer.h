// SPDX-License-Identifier: Apache-2.0
// The loop closures of a log, and where they say that its robot's path really was.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/loop/robot_graph.h"
#include "ingest/trajectory/robot_path.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// What loop closures have done to a log, for the user.
struct LoopCounts {
  int64_t loop_count = 0;
  int64_t kept_count = 0;
  /// Outside the robot's trajectory.
  int64_t unusable_count = 0;
  /// That said again what another one said.
  int64_t repeated_count = 0;
  /// By how much the trajectory has moved at most, metres.
  double largest_m = 0.0;
  /// Where those that were not believed stood: "loops.jsonl:3".
  std::vector<std::string> doubted;
};

/// Threads: one caller at a time.
class LoopCloser {
 public:
  /// `path` must outlive this. `is_on`: false for logs of which the robot's path is of no interest.
  LoopCloser(const RobotGraphOptions& options, RobotPath* path, bool is_on)
      : options_(options), path_(*path), is_on_(is_on), graph_(options, *path) {}

  bool is_on() const { return is_on_; }

  /// False for what is no loop closure, and if this is off.
  bool Take(const Measurement& measurement);

  /// Corrects the path by the loop closures so far, if there are others than last time and it is
  /// time (RobotGraphOptions::correct_period_ns), or `is_last`. Returns how what is in the map
  /// moves; identity if the path stays.
  /// Errors: of RobotGraph::Solve.
  absl::StatusOr<TrajectoryChange> Correct(TimeNs now_ns, bool is_last);

  /// The path in the map, with the covariances of the last Correct.
  std::vector<TimedPose> CorrectedPoses() const;
  /// Odometry and loop closures behind the path, for the store. Errors: of RobotGraph::Solve.
  absl::StatusOr<std::vector<PoseFactor>> Factors();
  /// Of the last Correct.
  const LoopCounts& counts() const { return counts_; }

 private:
  absl::Status Solve(bool is_last);
  bool IsDue(TimeNs now_ns) const;

  RobotGraphOptions options_;
  RobotPath& path_;
  bool is_on_;
  bool has_news_ = false;
  bool is_solved_ = false;
  TimeNs solved_ns_ = kTimeMin;
  std::vector<std::string> origins_;
  RobotGraph graph_;
  RobotGraph::Solution solution_;
  LoopCounts counts_;
};

}  // namespace dsg::ingest
