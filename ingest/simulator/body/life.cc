// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/life.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

constexpr double kYawStepS = 0.05;
/// The heading is averaged over this many steps to each side.
constexpr int kYawReach = 7;
/// Over this distance steps grow to their full length, and shrink again before a stop.
constexpr double kFirstStepM = 0.6;
constexpr double kTurnRateRadS = 1.6;
/// Turned by two small steps.
constexpr double kTurnPerCycleRad = 1.2;

double WrapAngle(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

const LifeSegment& SegmentAt(const std::vector<LifeSegment>& segments, TimeNs time_ns) {
  const auto after = std::upper_bound(
      segments.begin(), segments.end(), time_ns,
      [](TimeNs time, const LifeSegment& segment) { return time < segment.begin_ns; });
  return after == segments.begin() ? segments.front() : *std::prev(after);
}

GaitState WalkingGait(const BodyModel& body, const Walk& walk, double time_s) {
  const double distance = walk.DistanceAt(time_s);
  const double left = walk.path().length_m() - distance;
  GaitState gait;
  gait.phase_rad = 2.0 * std::numbers::pi * distance / StrideLengthM(body);
  gait.stride = SmoothStep(distance / kFirstStepM) * SmoothStep(left / kFirstStepM);
  return gait;
}

}  // namespace

double TurnDurationS(double from_rad, double to_rad) {
  // 1.5 is the peak slope of the smooth step.
  return 1.5 * std::abs(WrapAngle(to_rad - from_rad)) / kTurnRateRadS;
}

Walk::Walk(const Path& path, double cruise_m_s)
    : path_(path), profile_(path.length_m(), cruise_m_s, kAccelerationMps2) {
  duration_ns_ = std::max<TimeNs>(1, NsOf(profile_.duration_s()));
  const int count = static_cast<int>(std::ceil(profile_.duration_s() / kYawStepS)) + 1;
  std::vector<double> raw;
  for (int i = 0; i < count; ++i) {
    const double heading = path_.HeadingAt(DistanceAt(kYawStepS * i));
    raw.push_back(raw.empty() ? heading : raw.back() + WrapAngle(heading - raw.back()));
  }
  for (int i = 0; i < count; ++i) {
    // Shorter at the ends, which keep their headings.
    const int reach = std::min({kYawReach, i, count - 1 - i});
    double sum = 0.0;
    for (int j = i - reach; j <= i + reach; ++j) sum += raw[j];
    yaws_.push_back(sum / (2 * reach + 1));
  }
}

double Walk::YawAt(double time_s) const {
  const double at = std::clamp(time_s / kYawStepS, 0.0, static_cast<double>(yaws_.size() - 1));
  const size_t i = std::min(static_cast<size_t>(at), yaws_.size() - 1);
  const size_t next = std::min(i + 1, yaws_.size() - 1);
  const double fraction = at - static_cast<double>(i);
  return yaws_[i] + fraction * (yaws_[next] - yaws_[i]);
}

double LifeReach::ShareAt(TimeNs time_ns) const {
  const double after_s = SecondsOf(time_ns - contact_ns);
  const double half_hold = 0.5 * kHoldS;
  if (after_s < -half_hold) return SmoothStep((after_s + half_hold + kInS) / kInS);
  if (after_s > half_hold) return SmoothStep((half_hold + kOutS - after_s) / kOutS);
  return 1.0;
}

FloorState Life::FloorAt(const BodyModel& body, TimeNs time_ns) const {
  const LifeSegment& segment = SegmentAt(segments, time_ns);
  const TimeNs since_ns =
      std::clamp<TimeNs>(time_ns - segment.begin_ns, 0, segment.end_ns - segment.begin_ns);
  const double since_s = SecondsOf(since_ns);
  FloorState state;
  if (segment.walks) {
    state.position = segment.walk.PositionAt(since_s);
    state.yaw = segment.walk.YawAt(since_s);
    state.gait = WalkingGait(body, segment.walk, since_s);
  } else {
    const double length_s = SecondsOf(segment.end_ns - segment.begin_ns);
    const double turned = SmoothStep(since_s / length_s);
    const double turn = WrapAngle(segment.yaw_end - segment.yaw_begin);
    state.position = segment.position;
    state.yaw = segment.yaw_begin + turned * turn;
    state.gait.turn_phase_rad = 2.0 * std::numbers::pi * turned * std::abs(turn) / kTurnPerCycleRad;
    state.gait.turn_lift = SmoothStep(4.0 * turned) * SmoothStep(4.0 * (1.0 - turned)) *
                           SmoothStep(std::abs(turn) / 0.5);
  }
  state.gait.idle_s = idle_offset_s + SecondsOf(time_ns);
  return state;
}

Point Life::PositionAt(TimeNs time_ns) const {
  const LifeSegment& segment = SegmentAt(segments, time_ns);
  if (!segment.walks) return segment.position;
  return segment.walk.PositionAt(SecondsOf(time_ns - segment.begin_ns));
}

Pose3d StandingTorso(const BodyModel& body, const Point& position, double yaw) {
  Pose3d pose;
  pose.position = Eigen::Vector3d(position.x(), position.y(), body.pelvis_height_m());
  const double wrapped = WrapAngle(yaw);
  pose.orientation = Eigen::Quaterniond(std::cos(0.5 * wrapped), 0.0, 0.0, std::sin(0.5 * wrapped));
  return pose;
}

Pose3d Life::TorsoAt(const BodyModel& body, TimeNs time_ns) const {
  const FloorState floor = FloorAt(body, time_ns);
  return StandingTorso(body, floor.position, floor.yaw);
}

Posture Life::PostureAt(const BodyModel& body, TimeNs time_ns) const {
  const FloorState floor = FloorAt(body, time_ns);
  const Pose3d torso_T_map = StandingTorso(body, floor.position, floor.yaw).Inverse();
  Posture posture = TrunkPosture(body, floor.gait);
  for (const LifeReach& reach : reaches) {
    const double share = reach.ShareAt(time_ns);
    if (share > 0.0) LeanForReach(reach.plan, share, &posture);
  }
  PlantFeet(body, floor.gait, &posture);
  for (const LifeCarry& carry : carries) {
    // Both ends are in the middle of a hold, when the arm is wholly at its target.
    if (carry.begin_ns > time_ns || time_ns >= carry.end_ns) continue;
    StretchArm(body, carry.side, CarryPoint(body, carry.side), 1.0, &posture);
  }
  for (const LifeReach& reach : reaches) {
    const double share = reach.ShareAt(time_ns);
    if (share > 0.0) {
      StretchArm(body, reach.plan.side, torso_T_map * reach.target_map, share, &posture);
    }
  }
  return posture;
}

}  // namespace dsg::simulator
