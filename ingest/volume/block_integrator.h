// SPDX-License-Identifier: Apache-2.0
// Writes one frame into one block of voxels.
// Refuses to make blocks and to decide which ones a frame concerns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/volume/frame_view.h"
#include "ingest/volume/voxel_block.h"

namespace dsg::ingest {

/// Projects the centre of each voxel into the image (voxels far away are smaller than the gap
/// between rays, so every one of them is asked) and averages the distances it reads there.
///
/// Threads: safe from many, on different blocks.
/// Source: Oleynikova et al., 2017 (weights by squared distance, falling behind the surface);
/// RSS 2020, section IV-A (free space in front of people).
class BlockIntegrator {
 public:
  /// `instance_of_label`: map instance of each label of the frame, 65536 numbers or none.
  BlockIntegrator(const FrameView& view, const VolumeOptions& options,
                  const std::vector<uint32_t>& instance_of_label);

  void Integrate(VoxelBlock* block) const;

 private:
  void FuseRow(const Eigen::Vector3f& start, const Eigen::Vector3f& step, int first,
               VoxelBlock* block) const;
  void FuseSurface(const Reading& reading, float distance, float weight, VoxelBlock* block,
                   int index) const;
  void FuseFree(float depth, VoxelBlock* block, int index) const;
  static void FuseDistance(float distance, float weight, float weight_max, Voxel* voxel);
  void FuseColor(size_t pixel, Voxel* voxel) const;
  void FuseLabel(uint16_t label, VoxelBlock* block, int index) const;
  float WeightAt(float depth) const;

  /// FusionOptions, as voxels need them.
  struct Numbers {
    explicit Numbers(const FusionOptions& options);

    float full_weight_m;
    float weight_max;
    float free_weight_max;
    float slanted_min;
    float through_wall;
    float label_before_voxels;
    float label_behind_voxels;
    int color_count_max;
  };

  const FrameView& view_;
  const VolumeOptions& options_;
  Numbers numbers_;
  const std::vector<uint32_t>& instance_of_label_;
  Pose3d camera_T_map_;
  Eigen::Matrix3f steps_;
  float fx_, fy_, cx_, cy_;
};

}  // namespace dsg::ingest
