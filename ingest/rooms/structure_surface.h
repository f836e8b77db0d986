// SPDX-License-Identifier: Apache-2.0
// A mesh in blocks as one surface: vertices that blocks repeat become one, with their neighbours.
// Refuses vertices and faces that are not finite or point outside their block.
#pragma once

#include <span>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg::ingest {

struct StructureSurface {
  std::vector<Eigen::Vector3f> positions_map;
  /// Unit; zero where no face says which way. Of the blocks where they have them, else of the
  /// faces; smoothed over neighbours.
  std::vector<Eigen::Vector3f> normals_map;
  /// A third of the faces around each vertex, square metres.
  std::vector<float> areas_m2;
  /// -1 = the block has no labels.
  std::vector<int32_t> class_ids;
  /// Neighbours of vertex i: neighbours[first[i]] up to neighbours[first[i + 1]]; some twice.
  std::vector<uint32_t> first;
  std::vector<uint32_t> neighbours;

  std::span<const uint32_t> NeighboursOf(uint32_t vertex) const {
    return {neighbours.data() + first[vertex], neighbours.data() + first[vertex + 1]};
  }
};

/// Normals are smoothed over neighbours within an angle of cosine `smooth_cosine`.
/// Order: vertices as they first come. Cost: linear.
StructureSurface JoinBlocks(const std::vector<const MeshBlock*>& mesh, double smooth_cosine);

}  // namespace dsg::ingest
