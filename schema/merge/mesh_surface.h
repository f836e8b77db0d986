// SPDX-License-Identifier: Apache-2.0
// Mesh access for merging: blocks that a box touches, a cache of blocks, and a lookup of points on
// their surface.
#pragma once

#include <Eigen/Core>
#include <list>
#include <map>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/merge/mesh_join.h"
#include "schema/merge/point_grid.h"
#include "schema/model/geometry.h"
#include "schema/model/mesh.h"
#include "schema/store/snapshot.h"

namespace dsg::merge {

Box3d BoxOf(BlockIndex index, double block_size_m);

/// All blocks that touch a box. Order: ascending. Cost: proportional to the volume of the box.
std::vector<BlockIndex> BlocksIn(const Box3d& box, double block_size_m);

/// Threads: one caller at a time.
class BlockCache {
 public:
  /// Blocks are returned transformed by `map_T_stored`.
  BlockCache(std::shared_ptr<const Snapshot> map, const Pose3d& map_T_stored, size_t count_max)
      : map_(std::move(map)), map_T_stored_(map_T_stored), count_max_(count_max) {}

  absl::StatusOr<std::shared_ptr<const MeshBlock>> Read(BlockIndex index);

  /// Reads this block from `map` from now on; other blocks are not affected.
  void ReadAnew(BlockIndex index, std::shared_ptr<const Snapshot> map);

 private:
  using Entry = std::pair<BlockIndex, std::shared_ptr<const MeshBlock>>;

  std::shared_ptr<const Snapshot> map_;
  std::map<BlockIndex, std::shared_ptr<const Snapshot>> read_anew_;
  Pose3d map_T_stored_;
  size_t count_max_;
  /// Newest first.
  std::list<Entry> entries_;
  std::map<BlockIndex, std::list<Entry>::iterator> by_index_;
};

/// A point of a surface; the normal is zero when unknown.
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Stored normals, or normals from the faces; one per vertex.
std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block);

class SurfaceIndex {
 public:
  SurfaceIndex(std::vector<SurfacePoint> points, const MeshJoinOptions& options);

  /// Index of the nearest point whose surface holds `point`; -1 if there is none.
  int Find(const SurfacePoint& point) const;

 private:
  static std::vector<Eigen::Vector3d> PositionsOf(const std::vector<SurfacePoint>& points);

  std::vector<SurfacePoint> points_;
  MeshJoinOptions options_;
  double cosine_min_;
  PointGrid grid_;
};

}  // namespace dsg::merge
