// SPDX-License-Identifier: Apache-2.0
// The robot's own pose graph: keyframes of its trajectory, odometry between them, loop closures.
// Refuses to find loop closures, and to know what else hangs on the trajectory.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/config/option_field.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/pose_graph.h"
#include "ingest/loop/robust.h"
#include "ingest/trajectory/robot_path.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// The robot at `to_ns` seen from where it was at `from_ns`, by whatever recognised the place.
struct LoopClosure {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Pose3d from_T_to;
  /// Translation before rotation, as RelativePose::information.
  Matrix6d information = Matrix6d::Identity();
  /// Where it stood, for messages: "loops.jsonl:3".
  std::string origin;
};

struct RobotGraphOptions {
  /// A keyframe is taken after so much way, turn or time.
  double keyframe_m = 0.5;
  double keyframe_rad = 0.35;
  TimeNs keyframe_ns_max = 5'000'000'000;
  /// A log that would have more takes them further apart, at the same rate everywhere. The poses
  /// that loops bind are keyframes in any case.
  int keyframe_count_max = 20'000;
  /// Covariances are found of at most so many keyframes, and of none if loops bind more. At most
  /// kCovariancePosesMax.
  int covariance_count_max = static_cast<int>(kCovariancePosesMax);
  /// Errors of odometry are a random walk: so large a standard deviation after one metre or radian,
  /// and twice that after four, however many keyframes lie between...
  double odometry_m_per_m = 0.02;
  double odometry_rad_per_m = 0.005;
  double odometry_rad_per_rad = 0.02;
  /// ...and at least this between two keyframes, less between ends of loops that lie closer.
  double odometry_m_min = 0.005;
  double odometry_rad_min = 0.00087;
  /// Of roll and pitch between two keyframes, whatever lies between: odometry with an inertial unit
  /// sees gravity, and a map that loop closures tilt is worse than a turned one. Larger where
  /// nothing knows which way is up.
  double odometry_tilt_rad = 0.0002;
  RobustOptions robust;
  /// While a log runs, the path is solved anew at most so often, in log time, and only after
  /// another loop closure...
  TimeNs correct_period_ns = 10 * kNsPerSecond;
  /// ...and only after so large a share of the log so far: each correction writes the whole track
  /// and mesh anew, which adds up to 1 / share times their size however long the log is.
  double correct_share = 0.05;
  /// It is corrected if some keyframe has moved by so much, metres; at the end of the log by any.
  double correct_min_m = 0.05;
  /// With more loops than this the path is corrected at the end of the log only: each is compared
  /// with each.
  int correct_loop_count_max = 2000;

  /// Without the two errors of odometry that have flags of their own.
  std::vector<BoundOption> Bind();
};

/// Threads: one caller at a time. Deterministic.
class RobotGraph {
 public:
  /// `path`: its poses as given are what is solved. Must outlive the graph.
  RobotGraph(const RobotGraphOptions& options, const RobotPath& path);

  /// May come before the poses it speaks of; used by the next Solve.
  void AddLoop(const LoopClosure& loop);

  struct Solution {
    TrajectoryChange change;
    int64_t loop_count = 0;
    int64_t kept_count = 0;
    /// Loops whose stamps are outside the trajectory, and such that join a keyframe to itself.
    int64_t unusable_count = 0;
    /// Loops that say what one before them said of the same two poses (FindRepeated): they are left
    /// out.
    int64_t repeated_count = 0;
    std::vector<TimeNs> keyframe_times;
    /// How many times as far apart keyframes are as the options say, because of their number.
    double keyframe_spread = 1.0;
    /// By keyframe, of the pose against the first one (TimedPose::covariance); empty without loops,
    /// and of more keyframes than covariance_count_max.
    std::vector<Covariance6> covariances;
    /// By loop as added: whether it was believed. False for unusable and repeated ones.
    std::vector<bool> is_kept;
    std::vector<bool> is_repeated;
  };
  /// Identity when no usable loop is believed. Loops bind the two poses nearest to their stamps,
  /// which become keyframes; what the robot moved between stamp and pose is taken from odometry.
  /// RobustOptions::on_work hears of the parts that take long.
  /// Errors: of OptimizeRobustly.
  absl::StatusOr<Solution> Solve(bool has_covariances = true) const;

  /// "odometry" between keyframes and "loop_closure" (all of them but repeated ones; a loop that
  /// was not kept has the type "loop_closure_rejected"), for the store. `solution`: of the last
  /// Solve.
  std::vector<PoseFactor> Factors(const Solution& solution) const;

 private:
  struct BoundLoop;
  std::vector<BoundLoop> BindLoops() const;
  std::vector<BoundLoop> WithoutRepeated(const std::vector<BoundLoop>& bound,
                                         std::vector<bool>* is_repeated) const;
  std::vector<size_t> ChooseKeyframes(const std::vector<BoundLoop>& loops, double spread) const;
  Pose3d Given(size_t index) const;
  TimeNs TimeOf(size_t index) const;
  double ShareOfAStep(double way_m, double turn_rad, TimeNs time_ns) const;
  RelativePose Odometry(size_t from, size_t to) const;
  PoseGraph MakeGraph(const std::vector<size_t>& keyframes,
                      const std::vector<BoundLoop>& loops) const;

  RobotGraphOptions options_;
  const RobotPath& path_;
  std::vector<LoopClosure> loops_;
};

}  // namespace dsg::ingest
