// SPDX-License-Identifier: Apache-2.0
// Whose triangles are whose: by the instance ids of the mesh, or for structures by lying on their
// planes. Refuses to guess objects from boxes: a cup on a table is not part of the table.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/collision/convex.h"
#include "schema/base/time.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// What counts of a structure.
struct StructureFacts {
  NodeId id;
  Interval valid;
  bool is_floor = false;
  int32_t class_id = -1;
  uint32_t instance_id = 0;
  /// n.x + d = 0; where the node has no plane, that of its thinnest side.
  Eigen::Vector3d normal_map = Eigen::Vector3d::UnitZ();
  double offset_m = 0.0;
  /// Bounds in the map.
  Box3d box_map;
  /// Where no triangles are known: the box, or the cut of plane and box where the plane lies
  /// across it.
  std::vector<Convex> shapes;
};

StructureFacts FactsOf(const Node& structure);

/// Whether a triangle is part of a structure: all corners within 10 cm of its plane and box, facing
/// it, and of no other class. `label` 0 = unknown.
bool LiesOn(const StructureFacts& structure, const Convex& triangle, uint32_t label);

using StructureTable = std::unordered_map<NodeId, StructureFacts>;

absl::StatusOr<std::shared_ptr<const StructureTable>> ReadStructures(const Snapshot& snapshot,
                                                                     const StopCheck& stop);

/// A node that owns triangles by an instance id.
struct MeshOwner {
  NodeId id;
  bool is_object = true;
  Interval valid;
};

struct OwnerTable {
  /// Of several nodes of one instance the one with the lowest id.
  std::unordered_map<uint32_t, MeshOwner> by_instance;
  std::unordered_map<NodeId, uint32_t> instance_of;
};

absl::StatusOr<std::shared_ptr<const OwnerTable>> ReadOwners(const Snapshot& snapshot,
                                                             const StopCheck& stop);

}  // namespace dsg::query
