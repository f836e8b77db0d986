// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/pose_track.h"

#include <algorithm>

namespace dsg::ingest {
namespace {

constexpr double kTurnRadSMax = 20.0;
// Poses of high rate jitter; over a few milliseconds that is not a speed.
constexpr double kJitterM = 0.01;
constexpr double kJitterRad = 0.01;
// An hour at 100 Hz: 25 MB.
constexpr size_t kPosesMax = 400'000;

}  // namespace

bool PoseTrack::Add(TimeNs time_ns, const Pose3d& map_T_body) {
  if (!IsValidPose(map_T_body)) return false;
  if (!poses_.empty() && poses_.back().time_ns >= time_ns) return false;
  poses_.push_back({time_ns, map_T_body});
  if (poses_.size() > kPosesMax) poses_.pop_front();
  return true;
}

PoseTrack::Answer PoseTrack::At(TimeNs time_ns, Pose3d* map_T_body) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), time_ns,
                       [](const Stamped& pose, TimeNs time) { return pose.time_ns < time; });
  if (after == poses_.end()) return Answer::kNotYet;
  const bool is_exact = after->time_ns == time_ns;
  if (after == poses_.begin()) {
    if (!is_exact) return Answer::kNone;
    *map_T_body = after->map_T_body;
    return Answer::kKnown;
  }
  const auto before = std::prev(after);
  const TimeNs gap_ns = after->time_ns - before->time_ns;
  const bool is_gap = gap_ns > gap_ns_max_;
  if (is_gap && !is_exact) return Answer::kNone;
  if (!is_gap && IsJump(*before, *after)) return Answer::kJump;
  const double fraction =
      static_cast<double>(time_ns - before->time_ns) / static_cast<double>(gap_ns);
  *map_T_body =
      is_exact ? after->map_T_body : Interpolate(before->map_T_body, after->map_T_body, fraction);
  return Answer::kKnown;
}

bool PoseTrack::IsJump(const Stamped& from, const Stamped& to) const {
  const double seconds = 1e-9 * static_cast<double>(to.time_ns - from.time_ns);
  const double step_m = (to.map_T_body.position - from.map_T_body.position).norm();
  const double turn_rad = AngleBetween(from.map_T_body.orientation, to.map_T_body.orientation);
  return step_m > speed_m_s_max_ * seconds + kJitterM ||
         turn_rad > kTurnRadSMax * seconds + kJitterRad;
}

void PoseTrack::ForgetBefore(TimeNs time_ns) {
  while (poses_.size() > 2 && poses_[1].time_ns < time_ns) poses_.pop_front();
}

}  // namespace dsg::ingest
