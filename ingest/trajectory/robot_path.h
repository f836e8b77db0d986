// SPDX-License-Identifier: Apache-2.0
// The path of a log's robot, once for all stages: as the log gives it, and as it lies in the map.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/trajectory/pose_list.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/base/time.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

struct PathOptions {
  /// Two poses further apart than this do not tell where the robot was in between, ns.
  TimeNs gap_ns_max = 500'000'000;
  /// The robot does not move faster, m / s; between poses that say so it is nowhere.
  double speed_m_s_max = 20.0;
  /// Nor does it turn faster.
  double turn_rad_s_max = 20.0;
  /// Poses of high rate jitter; over a few milliseconds that is not a speed.
  double jitter_m = 0.01;
  double jitter_rad = 0.01;

  std::vector<BoundOption> Bind();
};

/// The log's poses are those of the odometry frame. Without a correction that is the map frame; a
/// correction says where the odometry frame stood in the map at each time.
///
/// Memory: that of PoseList. Corrections and loop closures may concern any pose, so all are kept,
/// on disk: 72 bytes a pose, 62 MB for eight hours at 30 Hz. Threads: one caller at a time. Source:
/// REP 105 (odom and map frames).
class RobotPath {
 public:
  enum class Answer {
    kKnown,
    /// A later pose may still come.
    kNotYet,
    /// Before the first pose, or in a gap.
    kNone,
    /// The poses around are too far apart for a robot.
    kJump,
  };

  /// `spill_folder`: of PoseList.
  explicit RobotPath(const PathOptions& options = {}, const std::string& spill_folder = "")
      : options_(options), poses_(spill_folder) {}

  /// The body's pose in the odometry frame, in map_T_agent. False, and nothing kept but a count,
  /// unless it is finite and later than the last one.
  bool Add(const TimedPose& given);
  /// Poses that Add refused.
  int64_t refused_count() const { return refused_count_; }

  /// Sets `map_T_body`, in the map, if the answer is kKnown. A pose of that very stamp is checked
  /// against the one before it.
  Answer At(TimeNs time_ns, Pose3d* map_T_body) const;
  /// The same in the odometry frame.
  Answer GivenAt(TimeNs time_ns, Pose3d* odom_T_body) const;

  /// Where something that was seen then, in the odometry frame, is in the map.
  Pose3d ToMap(TimeNs time_ns, const Pose3d& odom_T_thing) const;
  /// A pose as given, in the map.
  TimedPose InMap(const TimedPose& given) const;

  /// How what is in the map already would move by a correction (map frame from odometry frame) in
  /// the place of the one before.
  TrajectoryChange ChangeTo(const TrajectoryChange& map_T_odom) const;
  /// Replaces the correction.
  void Correct(TrajectoryChange map_T_odom) { map_T_odom_ = std::move(map_T_odom); }
  const TrajectoryChange& map_T_odom() const { return map_T_odom_; }
  bool is_corrected() const { return !map_T_odom_.IsIdentity(); }

  /// As given, ascending.
  const PoseList& poses() const { return poses_; }
  /// Of PoseList: once it is not OK, nothing that came of the path may be used.
  const absl::Status& status() const { return poses_.status(); }
  /// Index of the pose nearest in time. Requires: there are poses.
  size_t NearestIndex(TimeNs time_ns) const;
  /// In the odometry frame, interpolated across any gap, held at the ends. Requires: as above.
  Pose3d GivenNear(TimeNs time_ns) const;

 private:
  bool IsJump(const TimedPose& from, const TimedPose& to) const;

  PathOptions options_;
  PoseList poses_;
  TrajectoryChange map_T_odom_;
  int64_t refused_count_ = 0;
};

}  // namespace dsg::ingest
