// SPDX-License-Identifier: Apache-2.0
// Makes the mesh of one block of the store from the voxels under it.
// Refuses to decide which blocks are due.
#pragma once

#include <vector>

#include "ingest/volume/published_field.h"
#include "ingest/volume/voxel_meaning.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// Marching cubes over the centres of voxels. Positions depend on the two voxels of an edge alone,
/// so neighbouring blocks make the same bits of them. Positions are rounded to 0.1 mm and normals
/// to within 0.7 degrees (schema/model/mesh_grid.h), which the store keeps in few bytes.
///
/// Threads: one caller at a time; many of these may work at once.
/// Source: Lorensen and Cline, 1987.
class BlockMesher {
 public:
  BlockMesher(const BlockMap& blocks, const PublishedField& field, const VoxelMeaning& meaning,
              const InstanceBook& book, double block_size_m);

  /// Without small pieces that hang together with nothing.
  MeshBlock Make(const BlockIndex& index);

 private:
  bool Gather();
  void MeshCell(const Eigen::Vector3i& cell);
  uint32_t VertexOf(const Eigen::Vector3i& voxel, int axis);
  Eigen::Vector3f PointOn(const Eigen::Vector3i& voxel, int axis) const;
  float FractionOn(size_t low, size_t high) const;
  Eigen::Vector3f GradientAt(const Eigen::Vector3i& voxel) const;
  void AddMeaning(const Eigen::Vector3i& outside, const Eigen::Vector3i& inside);
  void AddMeaningAround(const Eigen::Vector3i& voxel, uint32_t* class_id,
                        uint32_t* instance_id) const;
  void AddTimes(const Eigen::Vector3i& outside, const Eigen::Vector3i& inside);
  void DropSpecks();
  void KeepFaces(const std::vector<uint8_t>& is_kept);
  size_t Offset(const Eigen::Vector3i& voxel) const {
    return (static_cast<size_t>(voxel.z()) * static_cast<size_t>(size_.y()) +
            static_cast<size_t>(voxel.y())) *
               static_cast<size_t>(size_.x()) +
           static_cast<size_t>(voxel.x());
  }

  const BlockMap& blocks_;
  const PublishedField& field_;
  const VoxelMeaning& meaning_;
  const InstanceBook& book_;
  double block_size_m_;

  // The voxels of the block and those around it; voxels are counted from low_.
  Eigen::Vector3i low_ = Eigen::Vector3i::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<float> distance_;
  // Vertex on the edge from a voxel along each axis, -1 = not made.
  std::vector<int32_t> vertex_on_edge_;
  std::vector<Eigen::Vector3i> cell_of_face_;
  MeshBlock mesh_;
};

}  // namespace dsg::ingest
