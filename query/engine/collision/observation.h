// SPDX-License-Identifier: Apache-2.0
// Whether the map knows anything around a body. Where nobody has looked, a missing obstacle proves
// nothing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/obstacles.h"
#include "query/engine/collision/shapes.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// A node or triangle nearer than this shows that somebody looked there.
inline constexpr double kObservedNearM = 1.0;

/// Points of the body's frame that stand for all of the body: of spheres the centre and both ends
/// of three diameters; of others the centre, the corners of its box and points between, no more
/// than 1 m apart but at most eight along an edge.
std::vector<Eigen::Vector3d> ObservedPoints(const Body& body);

/// Threads: one caller at a time.
class Observation {
 public:
  /// `finder` outlives it.
  explicit Observation(ObstacleFinder* finder) : finder_(finder) {}

  /// Whether, at every half metre of the way up to the pose `until_pose`, each of ObservedPoints is
  /// within a place's clearance or a mesh block, or within kObservedNearM of a triangle, an object
  /// or a structure. `known_near`, if not null, is a point on one of these three.
  /// Errors: what `stop` returned, asked at each pose; as Snapshot's.
  absl::StatusOr<bool> IsObserved(const Body& body, double until_pose,
                                  const Eigen::Vector3d* known_near, const StopCheck& stop);

 private:
  absl::StatusOr<bool> IsObserved(const Eigen::Vector3d& point_map, const StopCheck& stop);
  bool IsNodeNear(const Eigen::Vector3d& point_map, LayerId layer, double reach_m) const;
  bool IsInPlace(const Eigen::Vector3d& point_map, double radius_m) const;
  bool IsBallObserved(const Eigen::Vector3d& center_map, double radius_m) const;
  absl::StatusOr<bool> IsObservedAt(const Pose3d& map_T_body,
                                    const std::vector<Eigen::Vector3d>& points, double radius_m,
                                    const Eigen::Vector3d* known_near, const StopCheck& stop);

  ObstacleFinder* finder_;
};

}  // namespace dsg::query
