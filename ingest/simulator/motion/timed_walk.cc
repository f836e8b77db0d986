// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/timed_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ingest/simulator/world/path.h"

namespace dsg::simulator {
namespace {

constexpr double kStepM = 0.05;
// One looks at where one will be, but not straight through the next corner.
constexpr int kStepsBehind = 5;
constexpr int kStepsAhead = 9;
// Over which curvature is measured: shorter would take the roughness of the line for turns.
constexpr int kCurveSteps = 4;

// Points at the same distance from each other along the line.
std::vector<Point> Resample(const std::vector<Point>& line, double* step_m) {
  std::vector<double> along = {0.0};
  for (size_t i = 1; i < line.size(); ++i) {
    along.push_back(along.back() + (line[i] - line[i - 1]).norm());
  }
  const int step_count = static_cast<int>(std::ceil(along.back() / kStepM));
  *step_m = step_count > 0 ? along.back() / step_count : 0.0;
  std::vector<Point> points = {line.front()};
  size_t next = 1;
  for (int i = 1; i < step_count; ++i) {
    const double distance = i * *step_m;
    while (along[next] < distance) ++next;
    const double fraction = (distance - along[next - 1]) / (along[next] - along[next - 1]);
    points.push_back(line[next - 1] + fraction * (line[next] - line[next - 1]));
  }
  if (step_count > 0) points.push_back(line.back());
  return points;
}

}  // namespace

TimedWalk::TimedWalk(const std::vector<Point>& line, const WalkLimits& limits)
    : points_(Resample(line, &step_m_)) {
  SetHeadings();
  SetTimes(limits);
}

void TimedWalk::SetHeadings() {
  const int last = static_cast<int>(points_.size()) - 1;
  double heading = 0.0;
  for (int i = 0; i <= last; ++i) {
    const Point chord =
        points_[std::min(last, i + kStepsAhead)] - points_[std::max(0, i - kStepsBehind)];
    if (chord.norm() > 0.0) {
      const double wrapped = std::atan2(chord.y(), chord.x());
      heading =
          i == 0 ? wrapped : heading + std::remainder(wrapped - heading, 2.0 * std::numbers::pi);
    }
    headings_.push_back(heading);
  }
}

std::vector<double> TimedWalk::SpeedLimits(const WalkLimits& limits) const {
  const int last = static_cast<int>(points_.size()) - 1;
  std::vector<double> speeds(points_.size(), limits.speed_m_s);
  for (int i = 0; i < last; ++i) {
    const double turn = std::abs(headings_[i + 1] - headings_[i]) / step_m_;
    if (turn <= 0.0) continue;
    for (const int end : {i, i + 1}) {
      speeds[end] = std::min(speeds[end], limits.turn_rad_s / turn);
    }
  }
  for (int i = 1; i < last; ++i) {
    const int reach = std::min({kCurveSteps, i, last - i});
    const Point bend = points_[i - reach] - 2.0 * points_[i] + points_[i + reach];
    const double curvature = bend.norm() / (reach * step_m_ * reach * step_m_);
    if (curvature > 0.0) {
      speeds[i] = std::min(speeds[i], std::sqrt(limits.acceleration_m_s2 / curvature));
    }
  }
  return speeds;
}

void TimedWalk::SetTimes(const WalkLimits& limits) {
  const size_t count = points_.size();
  speeds_ = SpeedLimits(limits);
  speeds_.front() = 0.0;
  speeds_.back() = 0.0;
  const double gain = 2.0 * limits.acceleration_m_s2 * step_m_;
  for (size_t i = 1; i < count; ++i) {
    speeds_[i] = std::min(speeds_[i], std::sqrt(speeds_[i - 1] * speeds_[i - 1] + gain));
  }
  for (size_t i = count - 1; i > 0; --i) {
    speeds_[i - 1] = std::min(speeds_[i - 1], std::sqrt(speeds_[i] * speeds_[i] + gain));
  }
  times_ = {0.0};
  for (size_t i = 1; i < count; ++i) {
    // A line of a single step speeds up in its first half and brakes in the second.
    const double mean = count == 2 ? 0.25 * std::sqrt(gain) : 0.5 * (speeds_[i - 1] + speeds_[i]);
    times_.push_back(times_.back() + step_m_ / mean);
  }
}

double TimedWalk::StepsAt(double time_s) const {
  const auto next = std::upper_bound(times_.begin(), times_.end(), time_s);
  if (next == times_.begin()) return 0.0;
  if (next == times_.end()) return static_cast<double>(points_.size() - 1);
  const size_t i = static_cast<size_t>(next - times_.begin());
  const double span = times_[i] - times_[i - 1];
  const double since = time_s - times_[i - 1];
  const double gain = (speeds_[i] - speeds_[i - 1]) / span;
  const double walked =
      points_.size() == 2 ? step_m_ * since / span : (speeds_[i - 1] + 0.5 * gain * since) * since;
  return static_cast<double>(i - 1) + std::clamp(walked / step_m_, 0.0, 1.0);
}

Point TimedWalk::PositionAt(double time_s) const {
  const double steps = StepsAt(time_s);
  const size_t i = static_cast<size_t>(steps);
  if (i + 1 >= points_.size()) return points_.back();
  return points_[i] + (steps - static_cast<double>(i)) * (points_[i + 1] - points_[i]);
}

double TimedWalk::HeadingAt(double time_s) const {
  const double steps = StepsAt(time_s);
  const size_t i = static_cast<size_t>(steps);
  if (i + 1 >= headings_.size()) return headings_.back();
  return headings_[i] + (steps - static_cast<double>(i)) * (headings_[i + 1] - headings_[i]);
}

}  // namespace dsg::simulator
