// SPDX-License-Identifier: Apache-2.0
// Objects of unknown shape: pieces of the labelled mesh that hang together.
// Refuses to guess what nobody has seen, but for the way from an object down to the floor.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/objects/instance_parts.h"
#include "ingest/objects/object_options.h"
#include "ingest/objects/surface_cells.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"

namespace dsg::ingest {

struct ClusterOptions {
  double voxel_m = 0.1;
  /// RSS 2020: twice the voxel; 0 = that.
  double tolerance_m = 0.0;
  PieceOptions pieces;
  /// Classes that are objects: everything but structures and people.
  std::vector<int32_t> class_ids;
  /// Height of the floor that objects stand on; empty = from the horizontal surfaces of the mesh
  /// that are no objects, storey by storey.
  std::optional<double> floor_z_m;
};

struct ObjectCluster {
  int32_t class_id = -1;
  /// The mesh instance that most of its points have; 0 = none.
  uint32_t instance_id = 0;
  /// Thinned surface points, sorted; enough to fit a shape to.
  std::vector<Eigen::Vector3f> points_map;
  /// Middle of the box of the points, extended to what it stands on.
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
  /// Mean of the points.
  Eigen::Vector3d centroid_map = Eigen::Vector3d::Zero();
  /// The object stands there, and not in the middle of its box.
  bool is_at_centroid = false;
  /// Upright box with the least footprint: pose of its centre (yaw only) and edge lengths.
  Pose3d map_T_box;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  Color color{};
  /// First and last picture of a thing that was found in pictures; kTimeMax, kTimeMin otherwise.
  TimeNs first_seen_ns = kTimeMax;
  TimeNs last_seen_ns = kTimeMin;
  /// In how many pictures; 0 otherwise.
  int64_t seen_count = 0;
};

/// Vertices without faces will do. Blocks whose labels have a wrong length are ignored; options
/// that make no sense (a voxel of 0) find nothing.
///
/// Order: ascending by class, then by position; the same mesh gives the same clusters, whatever the
/// order of its blocks.
/// Source: RSS 2020, section IV-B (Euclidean clustering, PCL); instances split and join clusters.
std::vector<ObjectCluster> FindClusters(const std::vector<const MeshBlock*>& mesh,
                                        const ClusterOptions& options);

/// The order of FindClusters.
void SortClusters(std::vector<ObjectCluster>* clusters);

/// Groups of cells of `surface`, none of them empty, as clusters, in the order of the groups.
/// `floors_m`: ascending heights of the floors; `voxel_m`: edge of the cells.
std::vector<ObjectCluster> ClustersOfGroups(ObjectSurface surface,
                                            const std::vector<CellGroup>& groups,
                                            std::vector<double> floors_m, double voxel_m,
                                            const PieceOptions& options = {});

}  // namespace dsg::ingest
