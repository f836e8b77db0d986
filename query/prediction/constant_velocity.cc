// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "query/prediction/path_check.h"
#include "query/prediction/prediction.h"
#include "schema/base/check.h"

namespace dsg::query {
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

}  // namespace dsg::query
