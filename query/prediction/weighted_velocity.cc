// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "query/prediction/path_check.h"
#include "query/prediction/prediction.h"
#include "schema/base/check.h"

namespace dsg::query {
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
