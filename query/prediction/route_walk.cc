// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/route_walk.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace dsg::query {
namespace {

/// Coarse enough to be cheap, fine enough to look smooth.
constexpr double kStepM = 0.1;

class Walker {
 public:
  Walker(const Route& route, const Eigen::Vector3d& heading_map, const Pace& pace,
         const GoalOptions& options)
      : route_(route),
        heading_map_(heading_map),
        pace_(pace),
        // Two steps stay below the margin, so that the line between two positions that are free
        // with the margin is free without it.
        step_m_(std::min(kStepM, 0.4 * options.clearance_m_min)),
        step_s_(step_m_ / pace.peak_m_s()),
        options_(options),
        position_map_(route.points_map.front()) {}

  const Eigen::Vector3d& position_map() const { return position_map_; }

  void WalkUntil(double seconds) {
    while (seconds_ < seconds) {
      if (seconds_ >= options_.blend_s && IsAtEnd()) break;
      const double step_s = std::min(step_s_, seconds - seconds_);
      if (pace_.SpeedAt(seconds_ + 0.5 * step_s) <= 0.0) break;
      Step(step_s);
      seconds_ += step_s;
    }
    seconds_ = seconds;
  }

 private:
  /// The line from the position to the route at `along_m_` is always free: both ends lie within the
  /// clearance of one point of the route, less the margin, or are the same.
  void Step(double step_s) {
    const double way_m = pace_.SpeedAt(seconds_ + 0.5 * step_s) * step_s;
    const double own_share =
        options_.blend_s > 0.0 ? std::max(0.0, 1.0 - seconds_ / options_.blend_s) : 0.0;
    size_t ahead = segment_;
    const Eigen::Vector3d to_target =
        route_.At(along_m_ + options_.look_ahead_m, &ahead) - position_map_;
    const double target_m = to_target.norm();
    Eigen::Vector3d step = own_share * way_m * heading_map_;
    if (target_m > 0.0) {
      step += (1.0 - own_share) * std::min(1.0, way_m / target_m) * to_target;
    }
    const Eigen::Vector3d wanted_map = position_map_ + step;
    const double least_m = 0.5 * (1.0 - own_share) * way_m;
    const double along_m = ProjectAlong(wanted_map, along_m_ + least_m, along_m_ + way_m);
    if (TryGo(along_m, wanted_map)) return;
    // Nothing is known to be free beside the route: along it, at full pace.
    if (TryGo(std::min(route_.length_m(), along_m_ + way_m), std::nullopt)) return;
    // Too far from there in one step. Back towards the route, the line that is free.
    const Eigen::Vector3d back = route_.At(along_m_, &segment_) - position_map_;
    position_map_ += std::min(1.0, way_m / back.norm()) * back;
  }

  /// To `wanted_map`, or as far towards it from the route at `along_m` as is free. False when
  /// nothing is free beside the route, or when that is further than two steps.
  bool TryGo(double along_m, const std::optional<Eigen::Vector3d>& wanted_map) {
    size_t segment = segment_;
    const Eigen::Vector3d on_route_map = route_.At(along_m, &segment);
    Eigen::Vector3d next_map = on_route_map;
    if (wanted_map.has_value()) {
      const double share = FreeShare(on_route_map, *wanted_map, segment);
      if (share <= 0.0) return false;
      next_map += share * (*wanted_map - on_route_map);
    }
    if ((next_map - position_map_).norm() > 2.0 * step_m_) return false;
    along_m_ = along_m;
    segment_ = segment;
    position_map_ = next_map;
    return true;
  }

  bool IsAtEnd() const {
    return along_m_ >= route_.length_m() &&
           (position_map_ - route_.points_map.back()).norm() < 1e-6;
  }

  /// The way along the route that is nearest to the position, within limits.
  double ProjectAlong(const Eigen::Vector3d& point_map, double from_m, double to_m) const {
    size_t segment = segment_;
    const Eigen::Vector3d a_map = route_.At(from_m, &segment);
    const Eigen::Vector3d b_map = route_.At(to_m, &segment);
    const Eigen::Vector3d chord = b_map - a_map;
    const double square = chord.squaredNorm();
    if (square == 0.0) return std::min(to_m, route_.length_m());
    const double share = std::clamp((point_map - a_map).dot(chord) / square, 0.0, 1.0);
    return std::min(from_m + share * (to_m - from_m), route_.length_m());
  }

  /// How far one may go from the route towards the point, as a share: both must lie within the
  /// clearance of one point of the route, less the margin. A ball is convex, so all between is
  /// free.
  double FreeShare(const Eigen::Vector3d& on_route_map, const Eigen::Vector3d& wanted_map,
                   size_t segment) const {
    const size_t begin = segment > 1 ? segment - 1 : 0;
    const size_t end = std::min(segment + 4, route_.points_map.size());
    double best = 0.0;
    for (size_t i = begin; i < end; ++i) {
      const double radius_m = route_.clearance_m[i] - options_.clearance_m_min;
      if (radius_m <= 0.0) continue;
      best = std::max(best, ShareInBall(on_route_map - route_.points_map[i],
                                        wanted_map - on_route_map, radius_m));
      if (best >= 1.0) return 1.0;
    }
    return best;
  }

  /// Largest t in 0..1 with |start + t * way| <= radius; 0 when the start is outside.
  static double ShareInBall(const Eigen::Vector3d& start, const Eigen::Vector3d& way,
                            double radius_m) {
    const double c = start.squaredNorm() - radius_m * radius_m;
    if (c > 0.0) return 0.0;
    const double a = way.squaredNorm();
    if (a == 0.0) return 1.0;
    const double b = start.dot(way);
    return std::clamp((-b + std::sqrt(b * b - a * c)) / a, 0.0, 1.0);
  }

  const Route& route_;
  const Eigen::Vector3d heading_map_;
  const Pace pace_;
  const double step_m_;
  const double step_s_;
  const GoalOptions& options_;
  Eigen::Vector3d position_map_;
  double seconds_ = 0.0;
  double along_m_ = 0.0;
  size_t segment_ = 0;
};

}  // namespace

std::vector<Eigen::Vector3d> WalkRoute(const Route& route, const Eigen::Vector3d& heading_map,
                                       const Pace& pace, const std::vector<double>& seconds,
                                       const GoalOptions& options) {
  Walker walker(route, heading_map, pace, options);
  std::vector<Eigen::Vector3d> positions_map;
  positions_map.reserve(seconds.size());
  for (const double time_s : seconds) {
    walker.WalkUntil(time_s);
    positions_map.push_back(walker.position_map());
  }
  return positions_map;
}

}  // namespace dsg::query
