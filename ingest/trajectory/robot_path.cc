// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/robot_path.h"

#include <algorithm>
#include <utility>

#include "schema/base/check.h"
#include "schema/model/rigid_motion.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<PathOptions> kPathFields[] = {
    {"path-gap", &PathOptions::gap_ns_max, 0.001, 3600.0,
     "Two poses farther apart do not tell where the robot was in between, seconds: half a second "
     "of a turn in place"},
    {"path-speed", &PathOptions::speed_m_s_max, 0.1, 1000.0,
     "Fastest robot, metres / second; between poses that say faster it is nowhere: flying ones"},
    {"path-turn", &PathOptions::turn_rad_s_max, 0.1, 1000.0,
     "Fastest turn, radians / second: three turns a second"},
    {"path-jitter", &PathOptions::jitter_m, 0.0, 10.0,
     "Steps by this are no speed however little time they take, metres: poses of high rate jitter"},
    {"path-turn-jitter", &PathOptions::jitter_rad, 0.0, 3.2, "The same of turns, radians"},
};

Pose3d Between(const TimedPose& before, const TimedPose& after, TimeNs time_ns) {
  const double fraction = static_cast<double>(time_ns - before.time_ns) /
                          static_cast<double>(after.time_ns - before.time_ns);
  return Interpolate(before.map_T_agent, after.map_T_agent, fraction);
}

}  // namespace

std::vector<BoundOption> PathOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PathOptions>(kPathFields, this, &bound);
  return bound;
}

bool RobotPath::Add(const TimedPose& given) {
  const bool is_later = poses_.empty() || given.time_ns > poses_.back().time_ns;
  if (!is_later || !IsValidPose(given.map_T_agent)) {
    ++refused_count_;
    return false;
  }
  poses_.Add(given);
  return true;
}

RobotPath::Answer RobotPath::GivenAt(TimeNs time_ns, Pose3d* odom_T_body) const {
  const size_t index = poses_.NotBefore(time_ns);
  if (index == poses_.size()) return Answer::kNotYet;
  const TimedPose after = poses_[index];
  const bool is_exact = after.time_ns == time_ns;
  if (index == 0) {
    if (!is_exact) return Answer::kNone;
    *odom_T_body = after.map_T_agent;
    return Answer::kKnown;
  }
  const TimedPose before = poses_[index - 1];
  const bool is_gap = after.time_ns - before.time_ns > options_.gap_ns_max;
  if (is_gap && !is_exact) return Answer::kNone;
  if (!is_gap && IsJump(before, after)) return Answer::kJump;
  *odom_T_body = is_exact ? after.map_T_agent : Between(before, after, time_ns);
  return Answer::kKnown;
}

RobotPath::Answer RobotPath::At(TimeNs time_ns, Pose3d* map_T_body) const {
  const Answer answer = GivenAt(time_ns, map_T_body);
  if (answer == Answer::kKnown) *map_T_body = ToMap(time_ns, *map_T_body);
  return answer;
}

bool RobotPath::IsJump(const TimedPose& from, const TimedPose& to) const {
  const double seconds = 1e-9 * static_cast<double>(to.time_ns - from.time_ns);
  const double step_m = (to.map_T_agent.position - from.map_T_agent.position).norm();
  const double turn_rad = AngleBetween(from.map_T_agent.orientation, to.map_T_agent.orientation);
  return step_m > options_.speed_m_s_max * seconds + options_.jitter_m ||
         turn_rad > options_.turn_rad_s_max * seconds + options_.jitter_rad;
}

Pose3d RobotPath::ToMap(TimeNs time_ns, const Pose3d& odom_T_thing) const {
  if (map_T_odom_.IsIdentity()) return odom_T_thing;
  Pose3d map_T_thing = map_T_odom_.At(time_ns) * odom_T_thing;
  map_T_thing.orientation.normalize();
  return map_T_thing;
}

TimedPose RobotPath::InMap(const TimedPose& given) const {
  TimedPose pose = given;
  if (!map_T_odom_.IsIdentity()) TransformPose(map_T_odom_.At(given.time_ns), &pose);
  return pose;
}

TrajectoryChange RobotPath::ChangeTo(const TrajectoryChange& map_T_odom) const {
  const TrajectoryChange& before = map_T_odom_;
  if (poses_.empty() || (before.IsIdentity() && map_T_odom.IsIdentity())) return {};
  // Keyframes of either are where the path bends; between them it moves stiffly.
  std::vector<TimeNs> times = before.times();
  times.insert(times.end(), map_T_odom.times().begin(), map_T_odom.times().end());
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<Pose3d> old_T_body;
  std::vector<Pose3d> new_T_body;
  for (const TimeNs time_ns : times) {
    const Pose3d odom_T_body = GivenNear(time_ns);
    old_T_body.push_back(before.At(time_ns) * odom_T_body);
    new_T_body.push_back(map_T_odom.At(time_ns) * odom_T_body);
  }
  return TrajectoryChange(std::move(times), std::move(old_T_body), std::move(new_T_body));
}

size_t RobotPath::NearestIndex(TimeNs time_ns) const {
  DSG_CHECK(!poses_.empty());
  const size_t index = poses_.NotBefore(time_ns);
  if (index == poses_.size()) return index - 1;
  if (index == 0 || poses_[index].time_ns - time_ns < time_ns - poses_[index - 1].time_ns) {
    return index;
  }
  return index - 1;
}

Pose3d RobotPath::GivenNear(TimeNs time_ns) const {
  DSG_CHECK(!poses_.empty());
  if (time_ns >= poses_.back().time_ns) return poses_.back().map_T_agent;
  const size_t after = poses_.NotBefore(time_ns + 1);
  if (after == 0) return poses_.front().map_T_agent;
  return Between(poses_[after - 1], poses_[after], time_ns);
}

}  // namespace dsg::ingest
