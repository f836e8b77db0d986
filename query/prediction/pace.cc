// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/pace.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dsg::query {
namespace {

/// People change their speed within a second or three, whatever three positions say.
constexpr double kChangeMinMS2 = 0.3;
constexpr double kChangeMaxMS2 = 1.5;
/// Cosine of the angle between two steps that go the same way.
constexpr double kSameWay = 0.85;
/// Of the step before the last two, which may be even, but not tell the opposite.
constexpr double kEvenMS = 0.05;

struct Step {
  Eigen::Vector2d velocity_map = Eigen::Vector2d::Zero();
  /// From its middle to the end of the path.
  double age_s = 0.0;

  double speed_m_s() const { return velocity_map.norm(); }
};

/// The last steps, latest first; false when there are not so many.
bool LastSteps(const std::vector<PathPoint>& path, std::array<Step, 3>* steps) {
  size_t count = 0;
  size_t later = path.size() - 1;
  for (size_t i = later; i-- > 0 && count < steps->size();) {
    if (path[i].time_ns == path[later].time_ns) continue;
    const double step_s = static_cast<double>(path[later].time_ns - path[i].time_ns) * 1e-9;
    Step& step = (*steps)[count++];
    step.velocity_map = (path[later].position_map - path[i].position_map).head<2>() / step_s;
    step.age_s = static_cast<double>(path.back().time_ns - path[i].time_ns) * 1e-9 - 0.5 * step_s;
    later = i;
  }
  return count == steps->size();
}

}  // namespace

double Pace::SpeedAt(double seconds) const {
  if (change_m_s2 == 0.0) return speed_m_s;
  const double change_m_s = change_m_s2 * seconds;
  return end_m_s > speed_m_s ? std::min(end_m_s, speed_m_s + change_m_s)
                             : std::max(end_m_s, speed_m_s - change_m_s);
}

double Pace::WayM(double seconds) const {
  if (change_m_s2 == 0.0) return speed_m_s * seconds;
  const double changing_s = std::min(seconds, std::abs(end_m_s - speed_m_s) / change_m_s2);
  return 0.5 * (speed_m_s + SpeedAt(changing_s)) * changing_s + end_m_s * (seconds - changing_s);
}

Pace PaceOf(const std::vector<PathPoint>& path, double speed_m_s, const GoalOptions& options) {
  const Pace even{speed_m_s, speed_m_s, 0.0};
  std::array<Step, 3> steps;
  if (!LastSteps(path, &steps)) return even;
  const double last_m_s = steps[0].speed_m_s();
  const double before_m_s = steps[1].speed_m_s();
  const double first_m_s = steps[2].speed_m_s();
  // Of the middle of the last step, half a step ago.
  const double change_m_s2 = (last_m_s - before_m_s) / (steps[1].age_s - steps[0].age_s);
  const double now_m_s = std::max(0.0, last_m_s + change_m_s2 * steps[0].age_s);
  const double bounded_m_s2 = std::clamp(std::abs(change_m_s2), kChangeMinMS2, kChangeMaxMS2);
  const double cosine_scaled = steps[0].velocity_map.dot(steps[1].velocity_map);
  if (before_m_s - last_m_s > options.pace_change_m_s_min && before_m_s < first_m_s + kEvenMS &&
      cosine_scaled >= kSameWay * last_m_s * before_m_s) {
    return {std::min(now_m_s, speed_m_s), 0.0, bounded_m_s2};
  }
  // Who is near the pace of a walk already has set out.
  const double setting_out_m_s = 0.8 * options.walking_m_s;
  if (last_m_s - before_m_s > options.pace_change_m_s_min && before_m_s > first_m_s - kEvenMS &&
      std::max(last_m_s, first_m_s) < setting_out_m_s) {
    const double start_m_s = std::max(speed_m_s, std::min(now_m_s, options.walking_m_s));
    return {start_m_s, options.walking_m_s, bounded_m_s2};
  }
  return even;
}

}  // namespace dsg::query
