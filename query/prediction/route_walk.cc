// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/route_walk.h"

#include <algorithm>
#include <cmath>

namespace dsg::query {
namespace {

/// Coarse enough to be cheap, fine enough to look smooth.
constexpr double kStepM = 0.1;

class Walker {
 public:
  Walker(const Route& route, const Eigen::Vector3d& velocity_map, const GoalOptions& options)
      : route_(route),
        velocity_map_(velocity_map),
        speed_m_s_(velocity_map.norm()),
        // Two steps stay below the margin, so that the line between two positions that are free
        // with the margin is free without it.
        step_m_(std::min(kStepM, 0.4 * options.clearance_m_min)),
        options_(options),
        position_map_(route.points_map.front()) {}

  const Eigen::Vector3d& position_map() const { return position_map_; }

  void WalkUntil(double seconds) {
    while (seconds_ < seconds) {
      if (seconds_ >= options_.blend_s && IsAtEnd()) break;
      const double step_s = std::min(step_m_ / speed_m_s_, seconds - seconds_);
      Step(step_s);
      seconds_ += step_s;
    }
    seconds_ = seconds;
  }

 private:
  void Step(double step_s) {
    const double way_m = speed_m_s_ * step_s;
    const double own_share =
        options_.blend_s > 0.0 ? std::max(0.0, 1.0 - seconds_ / options_.blend_s) : 0.0;
    size_t ahead = segment_;
    const Eigen::Vector3d to_target =
        route_.At(along_m_ + options_.look_ahead_m, &ahead) - position_map_;
    const double target_m = to_target.norm();
    Eigen::Vector3d step = own_share * step_s * velocity_map_;
    if (target_m > 0.0) {
      step += (1.0 - own_share) * std::min(1.0, way_m / target_m) * to_target;
    }
    const Eigen::Vector3d wanted_map = position_map_ + step;
    const double before_m = along_m_;
    const double least_m = 0.5 * (1.0 - own_share) * way_m;
    along_m_ = ProjectAlong(wanted_map, before_m + least_m, before_m + way_m);
    position_map_ = route_.At(along_m_, &segment_);
    const double share = FreeShare(position_map_, wanted_map);
    if (share > 0.0) {
      position_map_ += share * (wanted_map - position_map_);
      return;
    }
    // Nothing is known to be free beside the route: along it, at full pace.
    along_m_ = std::min(route_.length_m(), before_m + way_m);
    position_map_ = route_.At(along_m_, &segment_);
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
  double FreeShare(const Eigen::Vector3d& on_route_map, const Eigen::Vector3d& wanted_map) const {
    const size_t begin = segment_ > 1 ? segment_ - 1 : 0;
    const size_t end = std::min(segment_ + 4, route_.points_map.size());
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
  const Eigen::Vector3d velocity_map_;
  const double speed_m_s_;
  const double step_m_;
  const GoalOptions& options_;
  Eigen::Vector3d position_map_;
  double seconds_ = 0.0;
  double along_m_ = 0.0;
  size_t segment_ = 0;
};

}  // namespace

std::vector<Eigen::Vector3d> WalkRoute(const Route& route, const Eigen::Vector3d& velocity_map,
                                       const std::vector<double>& seconds,
                                       const GoalOptions& options) {
  Walker walker(route, velocity_map, options);
  std::vector<Eigen::Vector3d> positions_map;
  positions_map.reserve(seconds.size());
  for (const double time_s : seconds) {
    walker.WalkUntil(time_s);
    positions_map.push_back(walker.position_map());
  }
  return positions_map;
}

}  // namespace dsg::query
