// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/route.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace dsg::query {
namespace {

constexpr double kPartM = 0.25;

/// The point of the link that is nearest from above.
Eigen::Vector3d NearestOnLink(const Eigen::Vector3d& position_map, const Eigen::Vector3d& a_map,
                              const Eigen::Vector3d& b_map) {
  const Eigen::Vector2d link = (b_map - a_map).head<2>();
  const double square = link.squaredNorm();
  if (square == 0.0) return a_map;
  const double share = (position_map - a_map).head<2>().dot(link) / square;
  return a_map + std::clamp(share, 0.0, 1.0) * (b_map - a_map);
}

Attachment Via(const Eigen::Vector3d& position_map, const Eigen::Vector3d& via_map, int place,
               const WalkGraph& graph) {
  return {place, via_map,
          Horizontal(position_map, via_map) + (graph.places_map[place] - via_map).norm()};
}

bool OnStorey(const Eigen::Vector3d& position_map, const Eigen::Vector3d& point_map) {
  return std::abs(position_map.z() - point_map.z()) <= kStoreyHeightM;
}

void AppendPlaces(const Eigen::Vector3d& position_map, const GoalField& field,
                  std::vector<Attachment>* found) {
  const WalkGraph& graph = field.graph();
  for (const int i : field.index().PlacesNear(position_map, field.index().clearance_m_max())) {
    const Eigen::Vector3d& place_map = graph.places_map[i];
    const bool in_reach = Horizontal(position_map, place_map) <= graph.clearance_m[i];
    if (!in_reach || !OnStorey(position_map, place_map)) continue;
    found->push_back(Via(position_map, place_map, i, graph));
  }
}

/// What is nearest, place or link, though perhaps behind a wall.
void AppendNearest(const Eigen::Vector3d& position_map, const GoalField& field, double reach_m,
                   std::vector<Attachment>* found) {
  const WalkGraph& graph = field.graph();
  double best_m = reach_m;
  for (const int i : field.index().LinksNear(position_map, reach_m)) {
    const auto& [a, b] = graph.links[i];
    const Eigen::Vector3d via_map =
        NearestOnLink(position_map, graph.places_map[a], graph.places_map[b]);
    const double way_m = Horizontal(position_map, via_map);
    if (way_m > best_m || !OnStorey(position_map, via_map)) continue;
    best_m = way_m;
    *found = {Via(position_map, via_map, a, graph), Via(position_map, via_map, b, graph)};
  }
  for (const int i : field.index().PlacesNear(position_map, reach_m)) {
    const double way_m = Horizontal(position_map, graph.places_map[i]);
    if (way_m >= best_m || !OnStorey(position_map, graph.places_map[i])) continue;
    best_m = way_m;
    *found = {Via(position_map, graph.places_map[i], i, graph)};
  }
}

void Append(const Eigen::Vector3d& point_map, double clearance_m, Route* route) {
  const double step_m = (point_map - route->points_map.back()).norm();
  route->points_map.push_back(point_map);
  route->clearance_m.push_back(clearance_m);
  route->along_m.push_back(route->along_m.back() + step_m);
}

}  // namespace

std::vector<Attachment> Attach(const Eigen::Vector3d& position_map, const GoalField& field,
                               const GoalOptions& options) {
  const WalkGraph& graph = field.graph();
  std::vector<Attachment> found;
  AppendPlaces(position_map, field, &found);
  for (const int i : field.index().LinksNear(position_map, options.clearance_m_min)) {
    const auto& [a, b] = graph.links[i];
    const Eigen::Vector3d via_map =
        NearestOnLink(position_map, graph.places_map[a], graph.places_map[b]);
    // Links keep this from obstacles, so nothing stands between.
    const double kept_m = graph.link_clearance_m.empty()
                              ? options.clearance_m_min
                              : std::min(options.clearance_m_min, graph.link_clearance_m[i]);
    const bool in_reach = Horizontal(position_map, via_map) <= kept_m;
    if (!in_reach || !OnStorey(position_map, via_map)) continue;
    found.push_back(Via(position_map, via_map, a, graph));
    found.push_back(Via(position_map, via_map, b, graph));
  }
  if (found.empty()) AppendNearest(position_map, field, options.attach_m_max, &found);
  return found;
}

Eigen::Vector3d Route::At(double along, size_t* segment) const {
  size_t& i = *segment;
  while (i > 0 && along_m[i] > along) --i;
  while (i + 2 < points_map.size() && along_m[i + 1] < along) ++i;
  if (i + 1 >= points_map.size()) return points_map[i];
  const double length = along_m[i + 1] - along_m[i];
  const double share = length > 0.0 ? std::clamp((along - along_m[i]) / length, 0.0, 1.0) : 1.0;
  return points_map[i] + share * (points_map[i + 1] - points_map[i]);
}

Route BuildRoute(const Eigen::Vector3d& position_map, const Attachment& attachment,
                 const std::vector<int>& places, const WalkGraph& graph, double length_m_max) {
  const Eigen::Vector3d lift(0.0, 0.0, position_map.z() - attachment.via_map.z());
  Route route{{position_map}, {0.0}, {0.0}};
  if (attachment.via_map != graph.places_map[attachment.place]) {
    Append(attachment.via_map + lift, 0.0, &route);
  }
  for (const int place : places) {
    if (route.length_m() > length_m_max) break;
    Append(graph.places_map[place] + lift, graph.clearance_m[place], &route);
  }
  return route;
}

Route Straightened(const Route& route, const FreeSpace& space, double margin_m) {
  const std::vector<Eigen::Vector3d>& points = route.points_map;
  Route straight{{points.front()}, {std::max(0.0, space.RadiusM(points.front()))}, {0.0}};
  size_t from = 0;
  while (from + 1 < points.size()) {
    size_t to = from + 1;
    while (to + 1 < points.size() && space.IsClear(points[from], points[to + 1], margin_m)) ++to;
    const Eigen::Vector3d way = points[to] - points[from];
    const int part_count = 1 + static_cast<int>(way.norm() / kPartM);
    for (int part = 1; part <= part_count; ++part) {
      const Eigen::Vector3d next_map =
          part == part_count ? points[to] : (points[from] + way * part / part_count).eval();
      Append(next_map, std::max(0.0, space.RadiusM(next_map)), &straight);
    }
    from = to;
  }
  return straight;
}

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

namespace {

/// Coarse enough to be cheap, fine enough to look smooth.
constexpr double kWalkStepM = 0.1;

class Walker {
 public:
  Walker(const Route& route, const Eigen::Vector3d& heading_map, const Pace& pace,
         const GoalOptions& options)
      : route_(route),
        heading_map_(heading_map),
        pace_(pace),
        // Two steps stay below the margin, so that the line between two positions that are free
        // with the margin is free without it.
        step_m_(std::min(kWalkStepM, 0.4 * options.clearance_m_min)),
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
