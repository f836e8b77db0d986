// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/trajectory_change.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

// Axes nearer to the vertical than this count as upright.
constexpr double kUprightCosine = 0.9998;

bool IsUpright(const Eigen::Quaterniond& orientation) {
  return (orientation * Eigen::Vector3d::UnitZ()).z() > kUprightCosine;
}

// Between samples at either side of an instant.
Pose3d InterpolateAt(const std::vector<TimeNs>& times, const std::vector<Pose3d>& poses,
                     TimeNs time_ns) {
  const auto after = std::upper_bound(times.begin(), times.end(), time_ns);
  if (after == times.begin()) return poses.front();
  if (after == times.end()) return poses.back();
  const auto next = static_cast<size_t>(after - times.begin());
  const double fraction = static_cast<double>(time_ns - times[next - 1]) /
                          static_cast<double>(times[next] - times[next - 1]);
  return Interpolate(poses[next - 1], poses[next], fraction);
}

}  // namespace

TrajectoryChange::TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> new_T_old)
    : times_(std::move(times)), old_T_body_(times_.size()), new_T_body_(std::move(new_T_old)) {
  DSG_CHECK(new_T_body_.size() == times_.size());
  for (const Pose3d& pose : new_T_body_) {
    largest_m_ = std::max(largest_m_, pose.position.norm());
  }
}

TrajectoryChange::TrajectoryChange(std::vector<TimeNs> times, std::vector<Pose3d> old_T_body,
                                   std::vector<Pose3d> new_T_body)
    : times_(std::move(times)),
      old_T_body_(std::move(old_T_body)),
      new_T_body_(std::move(new_T_body)) {
  DSG_CHECK(old_T_body_.size() == times_.size() && new_T_body_.size() == times_.size());
  for (size_t i = 0; i < times_.size(); ++i) {
    const double shift_m = (new_T_body_[i].position - old_T_body_[i].position).norm();
    largest_m_ = std::max(largest_m_, shift_m);
  }
}

Pose3d TrajectoryChange::At(TimeNs time_ns) const {
  if (times_.empty()) return {};
  Pose3d new_T_old = InterpolateAt(times_, new_T_body_, time_ns) *
                     InterpolateAt(times_, old_T_body_, time_ns).Inverse();
  new_T_old.orientation.normalize();
  return new_T_old;
}

Pose3d MovePose(const Pose3d& map_T_thing, TimeNs first_ns, TimeNs last_ns,
                const TrajectoryChange& change) {
  const Pose3d by_first = change.At(first_ns) * map_T_thing;
  if (first_ns == last_ns) return by_first;
  return Interpolate(by_first, change.At(last_ns) * map_T_thing, 0.5);
}

Pose3d KeepUpright(const Pose3d& old_pose, const Pose3d& new_pose) {
  if (!IsUpright(old_pose.orientation)) return new_pose;
  const double yaw_rad = YawOf(new_pose.orientation * old_pose.orientation.conjugate());
  return {new_pose.position, (TurnAboutZ(yaw_rad) * old_pose.orientation).normalized()};
}

Pose3d MoveOf(const Eigen::Vector3d& center_map, TimeNs first_ns, TimeNs last_ns,
              const TrajectoryChange& change) {
  const Pose3d center{center_map, Eigen::Quaterniond::Identity()};
  return KeepUpright(center, MovePose(center, first_ns, last_ns, change)) * center.Inverse();
}

double YawOf(const Eigen::Quaterniond& rotation) {
  return 2.0 * std::atan2(rotation.z(), rotation.w());
}

Eigen::Quaterniond TurnAboutZ(double yaw_rad) {
  return {std::cos(0.5 * yaw_rad), 0.0, 0.0, std::sin(0.5 * yaw_rad)};
}

}  // namespace dsg::ingest
