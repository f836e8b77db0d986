// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/tracks/track_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

constexpr uint64_t kSensorStream = uint64_t{2} << 32;
constexpr uint64_t kLossStream = uint64_t{3} << 32;
constexpr double kNs = static_cast<double>(kNsPerSecond);

}  // namespace

TrackSensor::TrackSensor(const TrackSensorOptions& options, const AgentSpec& agent, uint64_t seed)
    : options_(options),
      is_robot_(agent.is_robot),
      random_(seed, kSensorStream + static_cast<uint64_t>(agent.index)),
      loss_random_(seed, kLossStream + static_cast<uint64_t>(agent.index)) {
  if (!is_robot_ && options_.gap_rate_per_min > 0.0) DrawLoss(0);
}

TimeNs TrackSensor::SampleTime(int64_t tick) {
  const double period_ns = kNs / options_.rate_hz;
  const double jitter_ns = random_.Normal() * options_.clock_jitter_s * kNs;
  // Below half a period, so that neighbouring samples cannot change places.
  const double bounded_ns = std::clamp(jitter_ns, -0.4 * period_ns, 0.4 * period_ns);
  const double time_ns = static_cast<double>(tick) * period_ns + bounded_ns;
  return std::max<TimeNs>(0, static_cast<TimeNs>(std::llround(time_ns)));
}

void TrackSensor::DrawLoss(TimeNs after_ns) {
  const double wait_s = loss_random_.Exponential() * 60.0 / options_.gap_rate_per_min;
  const double lost_s = loss_random_.Uniform(options_.gap_s_min, options_.gap_s_max);
  loss_begin_ns_ = after_ns + static_cast<TimeNs>(std::llround(wait_s * kNs));
  loss_end_ns_ = loss_begin_ns_ + static_cast<TimeNs>(std::llround(lost_s * kNs));
}

bool TrackSensor::IsLost(TimeNs time_ns) {
  while (time_ns >= loss_end_ns_) DrawLoss(loss_end_ns_);
  const bool lost = time_ns >= loss_begin_ns_;
  if (lost && !was_lost_) ++loss_count_;
  was_lost_ = lost;
  return lost;
}

Pose3d TrackSensor::Measure(const FloorPose& truth) {
  FloorPose seen = truth;
  const double yaw = truth.yaw + options_.yaw_noise_rad * random_.Normal();
  seen.yaw = std::remainder(yaw, 2.0 * std::numbers::pi);
  Pose3d pose = BodyPose(seen, is_robot_);
  for (int axis = 0; axis < 3; ++axis) {
    pose.position[axis] += options_.position_noise_m * random_.Normal();
  }
  return pose;
}

int64_t TickCount(double duration_s, double rate_hz) {
  return static_cast<int64_t>(std::floor(duration_s * rate_hz + 1e-9));
}

}  // namespace dsg::simulator
