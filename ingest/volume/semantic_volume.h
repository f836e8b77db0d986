// SPDX-License-Identifier: Apache-2.0
// What depth pictures add up to: a truncated signed distance field with colours, classes and
// instances, and the mesh of its surface.
// Refuses to know about nodes, stores and sensors: frames in, mesh blocks and grids out.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "ingest/grid/occupancy_grid.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/trajectory/trajectory_change.h"
#include "ingest/volume/fusion_options.h"
#include "ingest/volume/spill_options.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// What becomes of pixels that belong to people.
enum class DynamicMasking {
  /// Their rays clear free space up to the person; no surface is written. RSS 2020, section IV-A.
  kCarve,
  /// They are left out altogether.
  kDrop,
  /// They are integrated like everything else.
  kOff,
};

struct VolumeOptions {
  double voxel_m = 0.05;
  /// Distances are kept within this of a surface; 0 = FusionOptions::truncation_voxels.
  double truncation_m = 0.0;
  /// Readings further away are used to this distance only, as free space.
  double range_m = 10.0;
  DynamicMasking masking = DynamicMasking::kCarve;
  /// How much a label is believed: probability that a pixel shows the class it says.
  double label_confidence = 0.8;
  /// Threads to integrate with. The result does not depend on it.
  int thread_count = 2;
  /// Voxel blocks that there may be; frames that would need more are cut there, and counted.
  int64_t block_count_max = 220'000;
  /// How many of them stay in memory: those that frames did not show for longest go to disk.
  SpillOptions spill;
  FusionOptions fusion;
  InstanceOptions instances;
  MeshingOptions meshing;

  /// The numbers that change results, without those above that most users set.
  std::vector<BoundOption> Bind();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds.
  absl::Status Validate() const;
};

/// What a frame, or a log, did to the volume.
struct VolumeCounts {
  int64_t frame_count = 0;
  /// Pixels with a depth that was used, and those that belonged to people.
  int64_t pixel_count = 0;
  int64_t dynamic_pixel_count = 0;
  int64_t block_count = 0;
  /// Blocks that were not made because of block_count_max.
  int64_t refused_block_count = 0;
  /// Blocks that the last occupancy grid left out: so far from most that no grid could hold all.
  int64_t cut_block_count = 0;
  /// Blocks in memory; the rest is on disk.
  int64_t resident_block_count = 0;
};

/// Threads: one caller at a time.
/// Source: RSS 2020, section IV-A (metric-semantic mesh); Oleynikova et al., 2017 (weights);
/// Rosinol et al., 2020, Kimera (Bayesian labels).
class SemanticVolume {
 public:
  /// Requires: valid options.
  explicit SemanticVolume(const VolumeOptions& options);
  ~SemanticVolume();
  SemanticVolume(SemanticVolume&&) noexcept;
  SemanticVolume& operator=(SemanticVolume&&) noexcept;

  const VolumeOptions& options() const;
  VolumeCounts counts() const;

  /// Fuses one frame. The instances of its labels are matched with those already in the volume:
  /// the map's instance ids are unique over the run.
  ///
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID when a channel has the wrong size or the pose is no
  /// pose; then nothing has changed. Of status().
  absl::Status Integrate(const DepthFrame& frame);

  /// Of the disk that holds blocks which are not in memory: RESOURCE_EXHAUSTED/DISK_FULL, DATA_LOSS
  /// or UNAVAILABLE. What was asked of the volume since may be wrong: nothing of it may be used.
  const absl::Status& status() const;

  /// The blocks of the surface that changed since the last call, `block_size_m` wide, ascending
  /// by index, with normals, colours, labels (class ids) and instance ids (0 = none). A block
  /// without vertices has lost its surface. Vertices are shared within a block.
  /// Requires: the same `block_size_m` each time.
  std::vector<MeshBlock> TakeChangedMesh(double block_size_m);

  /// The path that the frames were seen from has moved: the blocks move with it (MoveBlocks). The
  /// next TakeChangedMesh gives what changed by that.
  void Move(const TrajectoryChange& change);

  /// Forgets all that was fused, but for the instances that labels had: those of the frames to come
  /// are numbered after them. The next TakeChangedMesh gives what is different then.
  void Clear();

  /// What has been seen of the space that holds all blocks, in cells of `cell_m` (a whole
  /// multiple of the voxel, or the voxel itself). A voxel is occupied where a surface passes
  /// through it or it is inside one: below half a voxel, nearer than At() asks for. A cell is
  /// occupied if one of its voxels is, free if at least half of them are, else unknown. What is
  /// too far from the rest for one grid is left out, and counted (cut_block_count).
  OccupancyGrid MakeOccupancy(double cell_m);

  /// What has been seen at a point: free where the distance is above one voxel, occupied where
  /// it is less and not far behind a surface.
  Occupancy At(const Eigen::Vector3d& point_map) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
