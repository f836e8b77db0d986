// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/velocity.h"

#include <algorithm>
#include <cmath>

#include "schema/base/check.h"

namespace dsg::query {

void CheckPath(const std::vector<PathPoint>& path) {
  for (size_t i = 0; i < path.size(); ++i) {
    DSG_CHECK(path[i].position_map.allFinite());
    DSG_CHECK(i == 0 || path[i - 1].time_ns <= path[i].time_ns);
  }
}

void CheckPathAndTimes(const std::vector<PathPoint>& path, const std::vector<TimeNs>& at_ns) {
  CheckPath(path);
  DSG_CHECK(!path.empty());
  TimeNs before_ns = path.back().time_ns;
  for (const TimeNs time_ns : at_ns) {
    DSG_CHECK(before_ns <= time_ns);
    before_ns = time_ns;
  }
}

double SecondsAhead(const std::vector<PathPoint>& path, TimeNs at_ns) {
  return static_cast<double>(at_ns - path.back().time_ns) * 1e-9;
}

namespace {

/// Requires: before <= time <= after.
PathPoint Between(const PathPoint& before, const PathPoint& after, TimeNs time_ns) {
  const double share = static_cast<double>(time_ns - before.time_ns) /
                       static_cast<double>(after.time_ns - before.time_ns);
  return {time_ns, before.position_map + share * (after.position_map - before.position_map)};
}

}  // namespace

std::vector<PathPoint> RecentTrack(const std::vector<PathPoint>& poses, TimeNs gap_ns_max) {
  if (poses.empty()) return {};
  std::vector<PathPoint> points = {poses.back()};
  const TimeNs last_ns = poses.back().time_ns;
  TimeNs age_ns = kTrackStepNs;
  size_t i = poses.size() - 1;
  while (i > 0 && age_ns <= kTrackSeenNs) {
    const PathPoint& after = poses[i];
    const PathPoint& before = poses[i - 1];
    if (after.time_ns - before.time_ns > gap_ns_max) break;
    if (last_ns - before.time_ns < age_ns) {
      --i;
      continue;
    }
    points.push_back(Between(before, after, last_ns - age_ns));
    age_ns += kTrackStepNs;
  }
  // `i` is now the first pose that no gap parts from the last one, unless there were enough.
  if (points.size() == 1 && last_ns - poses[i].time_ns >= kTrackStepNs / 2) {
    points.push_back(poses[i]);
  }
  std::reverse(points.begin(), points.end());
  return points;
}

namespace {

constexpr int kStepCountMax = 7;

/// How many seconds at full velocity the shrinking velocity is worth after `seconds`.
double EffectiveSeconds(double seconds, double damping) {
  if (damping == 0.0) return 0.0;
  const double log_damping = std::log(damping);
  // expm1 keeps all digits when hardly anything is damped.
  if (log_damping == 0.0) return seconds;
  return std::expm1(log_damping * seconds) / log_damping;
}

}  // namespace

Velocity LastVelocity(const std::vector<PathPoint>& path) { return SmoothedVelocity(path, 0.0); }

Velocity SmoothedVelocity(const std::vector<PathPoint>& path, double decay) {
  DSG_CHECK(decay >= 0.0 && decay <= 1.0);
  CheckPath(path);
  Velocity velocity;
  Eigen::Vector3d way_map = Eigen::Vector3d::Zero();
  double seconds = 0.0;
  double weight = 1.0;
  size_t later = path.empty() ? 0 : path.size() - 1;
  for (size_t i = later; i-- > 0 && velocity.step_count < kStepCountMax && weight > 0.0;) {
    const TimeNs step_ns = path[later].time_ns - path[i].time_ns;
    if (step_ns == 0) continue;
    way_map += weight * (path[later].position_map - path[i].position_map);
    seconds += weight * static_cast<double>(step_ns) * 1e-9;
    weight *= decay;
    later = i;
    ++velocity.step_count;
  }
  if (velocity.step_count > 0) velocity.velocity_map = way_map / seconds;
  return velocity;
}

PredictedPath PredictConstantVelocity(const std::vector<PathPoint>& path,
                                      const std::vector<TimeNs>& at_ns,
                                      const ConstantVelocityOptions& options) {
  DSG_CHECK(options.damping >= 0.0 && options.damping <= 1.0);
  DSG_CHECK(options.sigma_m_s >= 0.0 && std::isfinite(options.sigma_m_s));
  CheckPathAndTimes(path, at_ns);
  const Eigen::Vector3d velocity_map = SmoothedVelocity(path, options.decay).velocity_map;
  PredictedPath predicted;
  predicted.positions_map.reserve(at_ns.size());
  predicted.sigma_m.reserve(at_ns.size());
  for (const TimeNs time_ns : at_ns) {
    const double seconds = SecondsAhead(path, time_ns);
    predicted.positions_map.push_back(path.back().position_map +
                                      EffectiveSeconds(seconds, options.damping) * velocity_map);
    predicted.sigma_m.push_back(options.sigma_m_s * seconds);
  }
  return predicted;
}

namespace {

/// As many points as velocities are smoothed over.
constexpr size_t kPointCountMax = 8;
constexpr double kStepS = 0.4;
/// Of the correlation of neighbouring accelerations, its sign turned: 2/3 for nothing but noise,
/// below 0 for turns.
constexpr double kZigzagMin = -0.2;
constexpr double kZigzagMax = 0.4;
/// Of accelerations against steps: from here on damped as noise.
constexpr double kRoughMax = 0.3;
/// Keeps those who stand from dividing by nothing.
constexpr double kTinyM = 0.05;

/// From 0 (as a walker's) to 1 (as noise).
struct Noise {
  double zigzag = 0.0;
  double roughness = 0.0;
};

Noise NoiseOf(const std::vector<PathPoint>& path) {
  const size_t begin = path.size() - std::min(path.size(), kPointCountMax);
  Eigen::Vector3d bend_before_map = Eigen::Vector3d::Zero();
  double turned_back = 0.0;
  double square_sum = 0.0;
  double bend_sum_m = 0.0;
  double length_m = 0.0;
  for (size_t i = begin + 1; i < path.size(); ++i) {
    const Eigen::Vector3d step_map = path[i].position_map - path[i - 1].position_map;
    length_m += step_map.norm();
    if (i < begin + 2) continue;
    const Eigen::Vector3d bend_map =
        step_map - (path[i - 1].position_map - path[i - 2].position_map);
    turned_back -= bend_map.dot(bend_before_map);
    square_sum += bend_map.squaredNorm();
    bend_sum_m += bend_map.norm();
    bend_before_map = bend_map;
  }
  Noise noise;
  const double zigzag = turned_back / (square_sum + 1e-6);
  noise.zigzag = std::clamp((zigzag - kZigzagMin) / (kZigzagMax - kZigzagMin), 0.0, 1.0);
  noise.roughness = std::clamp(bend_sum_m / (length_m + kTinyM) / kRoughMax, 0.0, 1.0);
  return noise;
}

double Between(double steady, double noisy, double share) {
  return steady + share * (noisy - steady);
}

}  // namespace

PredictedPath PredictWeightedVelocity(const std::vector<PathPoint>& path,
                                      const std::vector<TimeNs>& at_ns,
                                      const WeightedVelocityOptions& options) {
  CheckPathAndTimes(path, at_ns);
  const Noise noise = NoiseOf(path);
  ConstantVelocityOptions constant;
  constant.decay = Between(options.decay_steady, options.decay_noisy, noise.zigzag);
  const double damping = Between(options.damping_steady, options.damping_noisy,
                                 std::max(noise.zigzag, noise.roughness));
  DSG_CHECK(damping >= 0.0);
  constant.damping = std::pow(damping, 1.0 / kStepS);
  constant.sigma_m_s = options.sigma_m_s;
  return PredictConstantVelocity(path, at_ns, constant);
}

}  // namespace dsg::query
