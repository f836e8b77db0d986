// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/route.h"

#include <algorithm>
#include <cmath>

namespace dsg::query {
namespace {

constexpr double kPartM = 0.25;

double Horizontal(const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map) {
  return (to_map - from_map).head<2>().norm();
}

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

}  // namespace dsg::query
