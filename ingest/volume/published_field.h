// SPDX-License-Identifier: Apache-2.0
// The distances that meshes are made from: those of the voxels, but held still where they hardly
// move, so that a mesh that has converged stays as it is.
// Refuses to differ between neighbours: all meshes are made from the same numbers, hence no cracks.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "ingest/volume/block_map.h"
#include "ingest/volume/frame_view.h"

namespace dsg::ingest {

/// Threads: reading from many.
class PublishedField {
 public:
  PublishedField(const BlockMap& blocks, const BandLengths& band, const MeshingOptions& options);

  /// Takes over the distances of the block's voxels that have moved by more than still_voxels.
  /// Returns the voxels (of the whole map) around which the mesh changes.
  std::optional<Eigen::AlignedBox3i> Publish(VoxelBlock* block) const;

  /// NaN where nothing has been seen.
  float DistanceOf(const Voxel& voxel) const;
  float At(const Eigen::Vector3i& voxel) const;

  /// Which corners of the cell are inside; 0 when no surface is to be made of it: some corner was
  /// not seen, or the surface is a jump from far before to far behind.
  int CaseOf(const std::array<float, 8>& corners) const;
  int CaseAt(const Eigen::Vector3i& cell) const;

  /// Surfaces of fewer faces are specks.
  int speck_face_count() const { return options_.speck_face_count; }
  /// The surface through the cell has fewer faces in all.
  bool IsSpeck(const Eigen::Vector3i& cell) const;

 private:
  const BlockMap& blocks_;
  BandLengths band_;
  MeshingOptions options_;
  float step_m_;
};

}  // namespace dsg::ingest
