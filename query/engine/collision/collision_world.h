// SPDX-License-Identifier: Apache-2.0
// What a body touches in a map as it was believed at one revision and stood at one instant: boxes
// first, then the triangles of the mesh. Where nobody has looked nothing is called free: such
// answers are marked.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <unordered_set>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/collision_cache.h"
#include "query/engine/collision/shapes.h"
#include "query/view/graph_view.h"
#include "schema/base/time.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// What a body may run into.
struct CollisionScope {
  bool objects = true;
  bool structures = true;
  bool mesh = true;
  bool agents = true;
  bool predicted_agents = false;
  /// Structures that are floors, and triangles that lie on them, are no obstacles.
  bool ignore_floor = false;
  /// Nodes that are no obstacles; CollisionWorld::Ignore fills it with what is below them too.
  std::unordered_set<NodeId> ignored;
  /// Closer than this counts as a hit.
  double margin_m = 0.0;
  /// Nothing further away than this is looked at. Requires: more than margin_m.
  double clearance_m_max = 2.0;
};

enum class ObstacleKind { kNone, kObject, kStructure, kMesh, kAgent, kPredictedAgent };

/// "object", "structure", "mesh", "agent", "predicted_agent", "" for none.
const char* ToString(ObstacleKind kind);

struct CollisionHit {
  bool hit = false;
  /// To the nearest obstacle on the whole way, or at the hit; clearance_m_max if nothing is in
  /// reach.
  double clearance_m = 0.0;
  ObstacleKind kind = ObstacleKind::kNone;
  /// Empty for triangles that belong to no node.
  NodeId node;
  /// On the obstacle.
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  /// Index of the pose before plus a fraction: of the first contact, or else of the nearest pass.
  double at_pose = 0.0;
  /// Whether the map knows mesh, place or node near all of the body, all the way: see Observation.
  bool observed = false;
};

/// Cheap to make, since what is costly is kept by the cache: one for each question.
///
/// Objects and structures count by their boxes, which are tight in their own frame, and by their
/// triangles instead where the mesh has some that are known to be theirs. A structure whose plane
/// lies across its box counts by the cut of both. Mesh triangles of objects that do not exist at
/// the instant do not count.
/// Exact: everything about a body that stands still, and spheres on their way. Others that move are
/// followed by steps that no contact deeper than 0.1 mm escapes; their clearance may be up to 5 mm
/// or 5 % too large.
/// Threads: one caller at a time.
class CollisionWorld {
 public:
  /// `at_ns`: world time; unset = what is valid for ever, and agents at their last poses, as far as
  /// these are recent. `view` and `snapshot` are of the same revision. `cache` outlives the world.
  static CollisionWorld Create(std::shared_ptr<const GraphView> view,
                               std::shared_ptr<const Snapshot> snapshot,
                               std::optional<TimeNs> at_ns, CollisionCache* cache);

  CollisionWorld(CollisionWorld&&) noexcept;
  CollisionWorld& operator=(CollisionWorld&&) noexcept;
  ~CollisionWorld();

  /// Leaves out a node and all below it. Errors: what `stop` returned.
  absl::Status Ignore(NodeId node, const StopCheck& stop, CollisionScope* scope) const;

  /// The first contact on the way, or else the smallest clearance; equal ones go by id.
  /// Errors: what `stop` returned (asked at each step of the way, and at every 256th pair of
  /// shapes); as Snapshot's.
  absl::StatusOr<CollisionHit> Check(const Body& body, const CollisionScope& scope,
                                     const StopCheck& stop);

 private:
  struct Impl;
  explicit CollisionWorld(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::query
