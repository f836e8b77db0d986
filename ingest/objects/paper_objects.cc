// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/paper_objects.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "ingest/objects/euclidean_clusters.h"

namespace dsg::ingest {
namespace {

using Points = std::vector<Eigen::Vector3f>;

// By class, each position once: neighbouring blocks share vertices.
std::map<int32_t, Points> VerticesOfClasses(const std::vector<const MeshBlock*>& mesh,
                                            const std::vector<int32_t>& class_ids) {
  std::map<int32_t, Points> vertices;
  for (const MeshBlock* block : mesh) {
    if (block == nullptr || block->labels.size() != block->positions_map.size()) continue;
    for (size_t i = 0; i < block->labels.size(); ++i) {
      const auto class_id = static_cast<int32_t>(block->labels[i]);
      if (std::find(class_ids.begin(), class_ids.end(), class_id) == class_ids.end()) continue;
      if (block->positions_map[i].allFinite())
        vertices[class_id].push_back(block->positions_map[i]);
    }
  }
  const auto key = [](const Eigen::Vector3f& point) {
    return std::tuple(point.x(), point.y(), point.z());
  };
  for (auto& [class_id, points] : vertices) {
    std::sort(points.begin(), points.end(),
              [&](const auto& a, const auto& b) { return key(a) < key(b); });
    points.erase(std::unique(points.begin(), points.end()), points.end());
  }
  return vertices;
}

ObjectCluster ClusterOf(int32_t class_id, Points points) {
  ObjectCluster cluster;
  cluster.class_id = class_id;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Box3d box;
  for (const Eigen::Vector3f& point : points) {
    sum += point.cast<double>();
    box.extend(point.cast<double>());
  }
  cluster.centroid_map = sum / static_cast<double>(points.size());
  cluster.is_at_centroid = true;
  cluster.map_T_box.position = box.center();
  cluster.center_map = box.center();
  cluster.size = box.sizes();
  cluster.points_map = std::move(points);
  return cluster;
}

}  // namespace

std::vector<ObjectCluster> FindPaperObjects(const std::vector<const MeshBlock*>& mesh,
                                            const ClusterOptions& options) {
  if (!(options.voxel_m > 0.0)) return {};
  const double tolerance_m =
      options.tolerance_m > 0.0 ? options.tolerance_m : 2.0 * options.voxel_m;
  std::vector<ObjectCluster> clusters;
  for (const auto& [class_id, vertices] : VerticesOfClasses(mesh, options.class_ids)) {
    for (const std::vector<int>& group : EuclideanClusters(vertices, tolerance_m)) {
      if (std::ssize(group) < options.pieces.cell_count_min) continue;
      Points points;
      for (const int index : group) points.push_back(vertices[static_cast<size_t>(index)]);
      clusters.push_back(ClusterOf(class_id, std::move(points)));
    }
  }
  SortClusters(&clusters);
  return clusters;
}

}  // namespace dsg::ingest
