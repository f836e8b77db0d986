// SPDX-License-Identifier: Apache-2.0
// Which triangles of the mesh are those of a node.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "query/engine/collision/collision_cache.h"
#include "schema/model/geometry.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"

namespace dsg::query {

/// The triangles of an object, a structure, a room or a region above rooms:
/// - those whose corners all have the node's instance id, if it has one, in its box or within 5 cm
///   of it: two pieces of a thing have one id;
/// - of other structures those that lie on it, as for collision questions (LiesOn);
/// - of other objects those with their middle in the box, 5 cm around it included, that are of no
///   other class;
/// - of rooms, regions and other nodes those with their middle over the footprint, or in the box
///   without one, between floor and ceiling with 10 cm around them: the walls of a room stand at
///   its border.
///
/// Threads: immutable.
class NodeMesh {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for agents, places, and nodes without an extent.
  static absl::StatusOr<NodeMesh> Of(const Node& node);

  /// Where its triangles can be, map frame.
  const Box3d& bounds_map() const { return bounds_map_; }
  /// The node's faces of a block, and the vertices that they use.
  MeshBlock Cut(const MeshBlock& block) const;

 private:
  explicit NodeMesh(const Node& node);
  bool IsOfNode(const MeshBlock& block, const std::array<uint32_t, 3>& face) const;

  Node node_;
  uint32_t instance_id_ = 0;
  /// Of structures without an instance id.
  std::optional<StructureFacts> structure_;
  Box3d bounds_map_;
};

}  // namespace dsg::query
