// SPDX-License-Identifier: Apache-2.0
// Which blocks of a mesh have triangles in a region: by where their triangles are, since a face
// belongs to the block of its first corner and may reach far out of it.
// Refuses to hold triangles.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "query/engine/collision/triangle_tree.h"
#include "schema/model/mesh.h"
#include "schema/model/revision.h"

namespace dsg::query {

struct BlockBounds {
  BlockIndex block;
  /// The revision that wrote it.
  Revision written = 0;
  /// Of its triangles; empty if it has none.
  Eigen::AlignedBox3f bounds;
};

/// The faces that can be used: those that name vertices, all of them finite.
std::vector<std::array<uint32_t, 3>> UsableFaces(const MeshBlock& block);

/// Of the usable faces.
Eigen::AlignedBox3f BoundsOf(const MeshBlock& block);

/// Threads: immutable.
class BlockTable {
 public:
  /// Requires: ascending by block, each once. Cost: n log n.
  explicit BlockTable(std::vector<BlockBounds> blocks);

  bool empty() const { return blocks_.empty(); }
  /// Ascending.
  const std::vector<BlockBounds>& blocks() const { return blocks_; }
  /// Whether there is a block, with or without triangles.
  bool Contains(BlockIndex block) const;
  /// Blocks with triangles whose bounds touch the region, ascending. Valid as long as the table.
  std::vector<const BlockBounds*> Touching(const Box3d& region) const;

 private:
  std::vector<BlockBounds> blocks_;
  // A flat triangle for each block that has any, from corner to corner of its bounds.
  TriangleTree tree_;
  // Of each such triangle.
  std::vector<size_t> block_of_face_;
};

}  // namespace dsg::query
