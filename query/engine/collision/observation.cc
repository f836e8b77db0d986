// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/observation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "query/engine/collision/sweep.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;

// A place is asked for its clearance up to here.
constexpr double kPlaceReachM = 3.0;
constexpr double kObservedStepM = 0.5;
constexpr double kPointsApartM = 1.0;
constexpr int kPointsOnEdgeMax = 8;

// The box of a body in its own frame.
Box3d BoxOf(const Body& body) {
  Vector3d half = 0.5 * body.size;
  switch (body.kind) {
    case Body::Kind::kMesh:
      return body.mesh->bounds();
    case Body::Kind::kCuboid:
      break;
    case Body::Kind::kSphere:
    case Body::Kind::kCapsule:
      half = Vector3d::Constant(body.radius_m);
      half.z() += 0.5 * body.length_m;
      break;
  }
  return Box3d(-half, half);
}

}  // namespace

std::vector<Vector3d> ObservedPoints(const Body& body) {
  if (body.kind == Body::Kind::kSphere) {
    std::vector<Vector3d> points = {Vector3d::Zero()};
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(Vector3d::Unit(axis) * body.radius_m);
      points.push_back(Vector3d::Unit(axis) * -body.radius_m);
    }
    return points;
  }
  const Box3d box = BoxOf(body);
  std::vector<Vector3d> points = {box.center()};
  std::array<int, 3> counts;
  for (int axis = 0; axis < 3; ++axis) {
    const double between = std::ceil(box.sizes()[axis] / kPointsApartM);
    counts[static_cast<size_t>(axis)] =
        static_cast<int>(std::clamp(between + 1.0, 2.0, double{kPointsOnEdgeMax}));
  }
  for (int x = 0; x < counts[0]; ++x) {
    for (int y = 0; y < counts[1]; ++y) {
      for (int z = 0; z < counts[2]; ++z) {
        const Vector3d fraction(static_cast<double>(x) / (counts[0] - 1),
                                static_cast<double>(y) / (counts[1] - 1),
                                static_cast<double>(z) / (counts[2] - 1));
        points.push_back(box.min() + fraction.cwiseProduct(box.sizes()));
      }
    }
  }
  return points;
}

bool Observation::IsNodeNear(const Vector3d& point_map, LayerId layer, double reach_m) const {
  if (reach_m < 0.0) return false;
  SpaceFilter filter;
  filter.layer = layer;
  bool found = false;
  finder_->view().ForEachNearest(point_map, filter, reach_m, [&](const ViewNode& node, double) {
    found = finder_->IsValid(node.valid);
    return !found;
  });
  return found;
}

bool Observation::IsInPlace(const Vector3d& point_map, double radius_m) const {
  SpaceFilter filter;
  filter.layer = layers::kPlaces;
  bool found = false;
  finder_->view().ForEachNearest(
      point_map, filter, kPlaceReachM, [&](const ViewNode& place, double) {
        const double distance_m = (place.map_T_node.position - point_map).norm();
        found = finder_->IsValid(place.valid) && distance_m + radius_m <= place.clearance_m;
        return !found;
      });
  return found;
}

// Proves it for all points of a ball at once; says nothing when it fails.
bool Observation::IsBallObserved(const Vector3d& center_map, double radius_m) const {
  const double reach_m = kObservedNearM - radius_m;
  return IsNodeNear(center_map, layers::kObjects, reach_m) ||
         IsNodeNear(center_map, layers::kStructures, reach_m) ||
         (radius_m <= kPlaceReachM && IsInPlace(center_map, radius_m));
}

absl::StatusOr<bool> Observation::IsObserved(const Vector3d& point_map, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const bool has_block, finder_->HasBlockAt(point_map, stop));
  if (has_block || IsNodeNear(point_map, layers::kObjects, kObservedNearM) ||
      IsNodeNear(point_map, layers::kStructures, kObservedNearM) || IsInPlace(point_map, 0.0)) {
    return true;
  }
  return finder_->HasTriangleNear(point_map, kObservedNearM, stop);
}

absl::StatusOr<bool> Observation::IsObservedAt(const Pose3d& map_T_body,
                                               const std::vector<Vector3d>& points, double radius_m,
                                               const Vector3d* known_near, const StopCheck& stop) {
  bool tried_ball = false;
  for (const Vector3d& point : points) {
    const Vector3d point_map = map_T_body * point;
    if (known_near != nullptr && (point_map - *known_near).norm() <= kObservedNearM) continue;
    DSG_ASSIGN_OR_RETURN(const bool has_block, finder_->HasBlockAt(point_map, stop));
    if (has_block) continue;
    if (!tried_ball && IsBallObserved(map_T_body * points.front(), radius_m)) return true;
    tried_ball = true;
    DSG_ASSIGN_OR_RETURN(const bool observed, IsObserved(point_map, stop));
    if (!observed) return false;
  }
  return true;
}

absl::StatusOr<bool> Observation::IsObserved(const Body& body, double until_pose,
                                             const Vector3d* known_near, const StopCheck& stop) {
  const std::vector<Vector3d> points = ObservedPoints(body);
  double radius_m = 0.0;
  for (const Vector3d& point : points) {
    radius_m = std::max(radius_m, (point - points.front()).norm());
  }
  for (size_t i = 0; i < body.poses.size() && static_cast<double>(i) <= until_pose; ++i) {
    const Pose3d& begin = body.poses[i];
    const Pose3d& end = body.poses[std::min(i + 1, body.poses.size() - 1)];
    const double steps = std::max(1.0, std::ceil(TravelM(body, begin, end) / kObservedStepM));
    for (double step = 0.0; step < steps; step += 1.0) {
      if (stop) DSG_RETURN_IF_ERROR(stop());
      const double fraction = step / steps;
      if (static_cast<double>(i) + fraction > until_pose) break;
      const Pose3d pose = step == 0.0 ? begin : Interpolate(begin, end, fraction);
      DSG_ASSIGN_OR_RETURN(const bool observed,
                           IsObservedAt(pose, points, radius_m, known_near, stop));
      if (!observed) return false;
    }
  }
  return true;
}

}  // namespace dsg::query
