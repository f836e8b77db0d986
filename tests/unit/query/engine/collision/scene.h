// SPDX-License-Identifier: Apache-2.0
// A map with things to run into, in a real store, and what looking at each of them says.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "query/engine/collision/collision_world.h"
#include "query/engine/collision/shapes.h"
#include "schema/base/random.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

Pose3d RandomPose(Random* random, double range_m);
Box3d RandomBox(Random* random);

Node ObjectAt(uint64_t index, const Pose3d& map_T_object, const Box3d& box_node);
/// With a plane unless `normal_map` is zero.
Node StructureAt(uint64_t index, const std::string& type, const Box3d& box_map,
                 const Eigen::Vector3d& normal_map);
Node AgentNode(uint64_t index);
TimedPose StandingAt(TimeNs time_ns, double x, double y, double z);

/// Blocks of 2 m with these triangles; instances are of faces, or empty.
std::vector<MeshBlock> Blocks(const std::vector<query::Convex>& triangles,
                              const std::vector<uint32_t>& instances);
/// Two triangles.
std::vector<query::Convex> Rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& v);

/// Stops the program when the store refuses something: nothing would be tested then.
class Scene {
 public:
  Scene();
  /// Returns the new revision.
  Revision Commit(GraphDelta delta);
  std::shared_ptr<const Snapshot> At(Revision revision);
  std::shared_ptr<const query::GraphView> ViewAt(Revision revision);
  query::CollisionWorld World(Revision revision, std::optional<TimeNs> at_ns = std::nullopt);
  query::CollisionCache& cache() { return cache_; }

 private:
  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
  std::unique_ptr<GraphWriter> writer_;
  int64_t sequence_ = 0;
  std::shared_ptr<query::SymbolTable> symbols_ = std::make_shared<query::SymbolTable>();
  std::map<Revision, std::shared_ptr<const query::GraphView>> views_;
  query::CollisionCache cache_;
};

/// A question whose errors fail the test.
query::CollisionHit Ask(query::CollisionWorld world, const query::Body& body,
                        const query::CollisionScope& scope);

query::Body SphereAt(double radius_m, const Eigen::Vector3d& center_map);

}  // namespace dsg::test
