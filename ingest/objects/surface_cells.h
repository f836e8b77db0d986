// SPDX-License-Identifier: Apache-2.0
// The vertices of a mesh that belong to objects, corrected by their instances and thinned to cells.
// Refuses to say which of them hang together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg::ingest {

struct SurfaceVertex {
  int32_t class_id = -1;
  /// Packed index of the voxel that holds it.
  uint64_t cell = 0;
  Eigen::Vector3f position_map = Eigen::Vector3f::Zero();
  /// Zero where the mesh has none.
  Eigen::Vector3f normal_map = Eigen::Vector3f::Zero();
  /// 0 = none.
  uint32_t instance_id = 0;
  /// 0xRRGGBB.
  uint32_t color = 0;
};

/// The vertices of one class in one voxel.
struct SurfaceCell {
  int32_t class_id = -1;
  /// Of most of its vertices that have one; 0 = none.
  uint32_t instance_id = 0;
  /// Their mean.
  Eigen::Vector3f point_map = Eigen::Vector3f::Zero();
  /// Range in ObjectSurface::vertices.
  uint32_t vertex_begin = 0;
  uint32_t vertex_end = 0;
};

struct ObjectSurface {
  /// Sorted by class, cell, position; equal ones once.
  std::vector<SurfaceVertex> vertices;
  /// Ascending by class, then voxel.
  std::vector<SurfaceCell> cells;
  bool has_colors = false;
};

/// Vertices with a label among `class_ids` (ascending). A vertex whose label disagrees with the
/// majority of its instance takes the majority; an unlabelled one of an object's instance too. The
/// instances of anything else are ignored, and so are vertices that are not finite and channels
/// of a wrong length. Requires: voxel_m > 0.
ObjectSurface GatherSurface(const std::vector<const MeshBlock*>& mesh,
                            const std::vector<int32_t>& class_ids, double voxel_m);

/// All vertices that are finite, whatever their labels, as of class `class_id`.
/// Requires: voxel_m > 0.
ObjectSurface GatherAllSurface(const std::vector<const MeshBlock*>& mesh, int32_t class_id,
                               double voxel_m);

}  // namespace dsg::ingest
