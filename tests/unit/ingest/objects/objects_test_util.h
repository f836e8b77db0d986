// SPDX-License-Identifier: Apache-2.0
// Meshes of boxes for tests of objects: vertices on a grid, as a volume would give them.
// Refuses to add noise of its own accord.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "ingest/objects/object_cluster.h"
#include "ingest/objects/object_tracker.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

inline constexpr int32_t kWall = 1;
inline constexpr int32_t kFloor = 2;
inline constexpr int32_t kChair = 11;
inline constexpr int32_t kTable = 12;
inline constexpr int32_t kCouch = 13;
inline constexpr int32_t kCup = 20;
inline constexpr int32_t kShelf = 24;

inline const Eigen::Vector3d kChairSize(0.45, 0.45, 0.9);

inline ClusterOptions FiveCentimetres() {
  ClusterOptions options;
  options.voxel_m = 0.05;
  options.class_ids = {kCup, kChair, kTable, kCouch, kShelf};
  return options;
}

/// What the vertices of a thing have in common.
struct Look {
  uint32_t label = 0;
  uint32_t instance = 0;
  uint32_t color = 0x808080;
};

/// Collects vertices of things.
class TestMesh {
 public:
  void AddVertex(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, const Look& look) {
    block_.positions_map.push_back(point.cast<float>());
    block_.normals_map.push_back(normal.cast<float>());
    block_.labels.push_back(look.label);
    block_.instance_ids.push_back(look.instance);
    block_.colors.push_back(look.color);
  }

  /// The four sides and the top, every `step_m`, turned about the middle.
  void AddBox(const Eigen::Vector3d& low, const Eigen::Vector3d& size, const Look& look,
              double step_m = 0.03, double yaw_rad = 0.0) {
    const Eigen::Vector3d middle = low + 0.5 * size;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3i counts = (size / step_m).array().ceil().cast<int>().max(1);
    for (int x = 0; x <= counts.x(); ++x) {
      for (int y = 0; y <= counts.y(); ++y) {
        for (int z = 0; z <= counts.z(); ++z) {
          const bool is_side = x == 0 || x == counts.x() || y == 0 || y == counts.y();
          if (!is_side && z != counts.z()) continue;
          const Eigen::Vector3d share =
              Eigen::Vector3d(x, y, z).cwiseQuotient(counts.cast<double>());
          const Eigen::Vector3d point = low + share.cwiseProduct(size);
          const Eigen::Vector3d normal =
              z == counts.z() ? Eigen::Vector3d::UnitZ().eval() : Eigen::Vector3d::UnitX().eval();
          AddVertex(middle + turn * (point - middle), turn * normal, look);
        }
      }
    }
  }

  void AddFloor(double side_m, double z_m) {
    for (double x = -side_m; x <= side_m; x += 0.05) {
      for (double y = -side_m; y <= side_m; y += 0.05) {
        AddVertex({x, y, z_m}, Eigen::Vector3d::UnitZ(), {kFloor, 0, 0x404040});
      }
    }
  }

  MeshBlock& block() { return block_; }

 private:
  MeshBlock block_;
};

inline std::vector<ObjectCluster> ClustersOf(const MeshBlock& mesh,
                                             const ClusterOptions& options = FiveCentimetres()) {
  return FindClusters({&mesh}, options);
}

/// The cluster of a solid box along the axes, its surface as points every 5 cm.
inline ObjectCluster BoxCluster(int32_t class_id, uint32_t instance, const Eigen::Vector3d& low,
                                const Eigen::Vector3d& size) {
  ObjectCluster cluster;
  cluster.class_id = class_id;
  cluster.instance_id = instance;
  cluster.center_map = low + 0.5 * size;
  cluster.centroid_map = cluster.center_map;
  cluster.map_T_box.position = cluster.center_map;
  cluster.size = size;
  TestMesh mesh;
  mesh.AddBox(low, size, {}, 0.05);
  cluster.points_map = mesh.block().positions_map;
  return cluster;
}

inline TrackedObject BoxObject(int64_t id, const Eigen::Vector3d& low,
                               const Eigen::Vector3d& size) {
  TrackedObject object;
  object.id = id;
  object.cluster = BoxCluster(1, 0, low, size);
  return object;
}

}  // namespace dsg::ingest
