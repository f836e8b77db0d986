// SPDX-License-Identifier: Apache-2.0
// What stands in a region of the map at an instant: convex shapes, agents where they are or are
// foreseen to be, and pieces of mesh with a rule of which triangles count.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/collision_cache.h"
#include "query/engine/collision/collision_world.h"
#include "query/engine/collision/shapes.h"
#include "schema/store/snapshot.h"

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

/// Someone without a box is a capsule around the pose, which is that of the torso.
inline constexpr double kAgentRadiusM = 0.3;
inline constexpr double kAgentHeightM = 1.7;
/// Standard deviations that are added to the radius of those who are foreseen.
inline constexpr double kForeseenSigmas = 2.0;
inline constexpr TimeNs kForeseenNsMax = 10 * kNsPerSecond;

/// Agents where they were at `at_ns`; those whose tracks have a gap or an end there are left out.
/// Unset: at their last poses, if these are no further than their gap limit before the newest pose
/// of all. Ascending id.
absl::StatusOr<std::vector<Obstacle>> AgentsAt(const Snapshot& snapshot,
                                               std::optional<TimeNs> at_ns, const StopCheck& stop);

/// Agents whose tracks end before `at_ns`, where they are if they walk on as they did: by weighted
/// velocity, one place each, through walls if need be. Goals on the places graph would cost some
/// milliseconds an agent and give several places.
absl::StatusOr<std::vector<Obstacle>> AgentsForeseenAt(const Snapshot& snapshot, TimeNs at_ns,
                                                       const StopCheck& stop);

}  // namespace dsg::query
