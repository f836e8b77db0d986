// SPDX-License-Identifier: Apache-2.0
// What stands in a region of the map at an instant: convex shapes, and pieces of mesh with a rule
// of which triangles count. Refuses to measure distances.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "query/engine/collision/collision_cache.h"
#include "query/engine/collision/collision_world.h"
#include "query/engine/collision/convex.h"

namespace dsg::query {

struct Obstacle {
  Convex shape;
  /// The obstacle is everything within this of the shape.
  double radius_m = 0.0;
  ObstacleKind kind = ObstacleKind::kNone;
  NodeId node;
};

/// Whose a triangle is.
struct FaceOwner {
  ObstacleKind kind = ObstacleKind::kMesh;
  NodeId node;
};

/// What a body in some region has to look at.
struct Obstacles {
  std::vector<Obstacle> solids;
  std::vector<std::shared_ptr<const MeshPiece>> pieces;
  /// Valid structures near, ascending id.
  std::vector<const StructureFacts*> structures;
  /// Those whose triangles do not count.
  std::vector<const StructureFacts*> left_out;
  /// Keep alive what is pointed to.
  std::shared_ptr<const StructureTable> structure_table;
  /// Null if no triangle near has an instance.
  std::shared_ptr<const OwnerTable> owners;

  void Clear();
};

/// Threads: one caller at a time.
class ObstacleFinder {
 public:
  ObstacleFinder(std::shared_ptr<const GraphView> view, std::shared_ptr<const Snapshot> snapshot,
                 std::optional<TimeNs> at_ns, CollisionCache* cache);

  const GraphView& view() const { return *view_; }
  bool IsValid(const Interval& valid) const {
    return at_ns_.has_value() ? valid.Contains(*at_ns_) : valid.to_ns == kTimeMax;
  }

  /// Everything that may touch `region`.
  absl::Status Find(const Box3d& region, const CollisionScope& scope, const StopCheck& stop,
                    Obstacles* found);
  /// nullopt if the triangle is no obstacle.
  std::optional<FaceOwner> OwnerOf(const Obstacles& found, const CollisionScope& scope,
                                   const MeshPiece& piece, int face, const Convex& triangle) const;
  /// Whether the mesh has a block at a point.
  absl::StatusOr<bool> HasBlockAt(const Eigen::Vector3d& point_map, const StopCheck& stop);
  /// Whether a triangle of the mesh, of whatever owner, is within `reach_m` of a point.
  absl::StatusOr<bool> HasTriangleNear(const Eigen::Vector3d& point_map, double reach_m,
                                       const StopCheck& stop);

 private:
  absl::Status AddPieces(const Box3d& region, const StopCheck& stop,
                         std::vector<std::shared_ptr<const MeshPiece>>* pieces);
  absl::Status AddStructures(const Box3d& region, const CollisionScope& scope,
                             const StopCheck& stop, Obstacles* found);
  absl::Status AddObjects(const Box3d& region, const CollisionScope& scope, const StopCheck& stop,
                          Obstacles* found);
  absl::Status AddAgents(const Box3d& region, const CollisionScope& scope, const StopCheck& stop,
                         Obstacles* found);
  absl::StatusOr<bool> StructureHasTriangles(const StructureFacts& structure,
                                             const StopCheck& stop);
  absl::StatusOr<bool> ObjectHasTriangles(const ViewNode& object, const StopCheck& stop);

  std::shared_ptr<const GraphView> view_;
  std::shared_ptr<const Snapshot> snapshot_;
  std::optional<TimeNs> at_ns_;
  CollisionCache* cache_;
  std::shared_ptr<RevisionFacts> facts_;
  // Found at the first question that asks for them.
  std::optional<std::vector<Obstacle>> agents_;
  std::optional<std::vector<Obstacle>> predicted_;
};

}  // namespace dsg::query
