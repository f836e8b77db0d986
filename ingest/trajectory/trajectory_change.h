// SPDX-License-Identifier: Apache-2.0
// How a corrected path moves what was seen from it, by when it was seen.
#pragma once

#include <functional>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Where things were thought to be, against where they are now, by the time of seeing them.
///
/// Threads: safe from many threads.
class TrajectoryChange {
 public:
  /// Identity everywhere.
  TrajectoryChange() = default;
  /// `times` ascending, one transform each: new map frame from old map frame.
  TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> new_T_old);
  /// The robot's poses before and after. Between keyframes both are interpolated, so that turns go
  /// around the robot and not around the map's origin.
  TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> old_T_body,
                   std::vector<Pose3d> new_T_body);

  /// Interpolated between keyframes, held at the ends.
  Pose3d At(TimeNs time_ns) const;
  bool IsIdentity() const { return times_.empty(); }
  /// Largest shift of a keyframe, metres.
  double largest_m() const { return largest_m_; }
  /// Of its keyframes; empty for the identity.
  const std::vector<TimeNs>& times() const { return times_; }

 private:
  std::vector<TimeNs> times_;
  std::vector<Pose3d> old_T_body_;
  std::vector<Pose3d> new_T_body_;
  double largest_m_ = 0.0;
};

/// What was seen from first_ns to last_ns moves halfway between the changes at both instants: a
/// wall that was passed twice was merged from both passes.
Pose3d MovePose(const Pose3d& map_T_thing, TimeNs first_ns, TimeNs last_ns,
                const TrajectoryChange& change);

/// The transform of that move for a thing around `center_map`, new map frame from old map frame,
/// without its tilt.
Pose3d MoveOf(const Eigen::Vector3d& center_map, TimeNs first_ns, TimeNs last_ns,
              const TrajectoryChange& change);

/// New map frame from old map frame, for what has no time of its own: by where it is.
using PointMove = std::function<Pose3d(const Eigen::Vector3d& point_map)>;

/// Takes what tilts a thing out of its move, if it stood upright before: gravity was known all
/// along.
Pose3d KeepUpright(const Pose3d& old_pose, const Pose3d& new_pose);

/// The turn of a rotation about the vertical, radians.
double YawOf(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond TurnAboutZ(double yaw_rad);

}  // namespace dsg::ingest
