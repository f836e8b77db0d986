// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/world/path.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

constexpr int kCornerPieces = 8;
constexpr double kHeadingReachM = 0.25;

// A quadratic Bezier from one leg to the next. It stays within cut / 4 of the legs: its middle,
// the farthest point, is half way between the corner and the chord's middle.
void AppendCorner(const Point& before, const Point& corner, const Point& after,
                  std::vector<Point>* points) {
  const Point to_before = before - corner;
  const Point to_after = after - corner;
  const double cut = std::min({Path::kCornerM, 0.45 * to_before.norm(), 0.45 * to_after.norm()});
  const Point begin = corner + cut * to_before.normalized();
  const Point end = corner + cut * to_after.normalized();
  for (int i = 0; i <= kCornerPieces; ++i) {
    const double t = static_cast<double>(i) / kCornerPieces;
    const double s = 1.0 - t;
    points->push_back(s * s * begin + 2.0 * s * t * corner + t * t * end);
  }
}

}  // namespace

Path::Path(const std::vector<Point>& waypoints) {
  points_ = {waypoints.front()};
  for (size_t i = 1; i + 1 < waypoints.size(); ++i) {
    AppendCorner(waypoints[i - 1], waypoints[i], waypoints[i + 1], &points_);
  }
  if (waypoints.size() > 1) points_.push_back(waypoints.back());
  distances_ = {0.0};
  for (size_t i = 1; i < points_.size(); ++i) {
    distances_.push_back(distances_.back() + (points_[i] - points_[i - 1]).norm());
  }
}

Point Path::At(double distance_m) const {
  const auto next = std::upper_bound(distances_.begin(), distances_.end(), distance_m);
  if (next == distances_.begin()) return points_.front();
  if (next == distances_.end()) return points_.back();
  const size_t i = static_cast<size_t>(next - distances_.begin());
  const double fraction = (distance_m - distances_[i - 1]) / (distances_[i] - distances_[i - 1]);
  return points_[i - 1] + fraction * (points_[i] - points_[i - 1]);
}

double Path::HeadingAt(double distance_m) const {
  const Point chord = At(distance_m + kHeadingReachM) - At(distance_m - kHeadingReachM);
  return std::atan2(chord.y(), chord.x());
}

SpeedProfile::SpeedProfile(double length_m, double cruise_m_s, double acceleration_m_s2)
    : length_m_(length_m), acceleration_(acceleration_m_s2) {
  // Too short to reach cruising speed: accelerate over one half, brake over the other.
  speed_ = std::min(cruise_m_s, std::sqrt(acceleration_ * length_m_));
  if (speed_ <= 0.0) return;
  ramp_s_ = speed_ / acceleration_;
  ramp_m_ = 0.5 * speed_ * ramp_s_;
  duration_s_ = 2.0 * ramp_s_ + std::max(0.0, length_m_ - 2.0 * ramp_m_) / speed_;
}

double SpeedProfile::DistanceAt(double time_s) const {
  if (time_s <= 0.0) return 0.0;
  if (time_s >= duration_s_) return length_m_;
  if (time_s < ramp_s_) return 0.5 * acceleration_ * time_s * time_s;
  const double left_s = duration_s_ - time_s;
  if (left_s < ramp_s_) return length_m_ - 0.5 * acceleration_ * left_s * left_s;
  return ramp_m_ + speed_ * (time_s - ramp_s_);
}

double SpeedProfile::TimeAt(double distance_m) const {
  if (distance_m <= 0.0) return 0.0;
  if (distance_m >= length_m_) return duration_s_;
  if (distance_m < ramp_m_) return std::sqrt(2.0 * distance_m / acceleration_);
  const double left_m = length_m_ - distance_m;
  if (left_m < ramp_m_) return duration_s_ - std::sqrt(2.0 * left_m / acceleration_);
  return ramp_s_ + (distance_m - ramp_m_) / speed_;
}

}  // namespace dsg::simulator
