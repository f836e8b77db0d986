// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/euclidean_clusters.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include <algorithm>

namespace dsg::ingest {

std::vector<std::vector<int>> EuclideanClusters(const std::vector<Eigen::Vector3f>& points,
                                                double tolerance_m) {
  if (points.empty()) return {};
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& point : points) {
    cloud->push_back(pcl::PointXYZ(point.x(), point.y(), point.z()));
  }
  // PCL refuses a tree that sorts its results; the order within a cluster is ours anyway.
  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>(/*sorted=*/false);
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(tolerance_m);
  extraction.setMinClusterSize(1);
  extraction.setMaxClusterSize(static_cast<pcl::uindex_t>(points.size()));
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> found;
  extraction.extract(found);
  std::vector<std::vector<int>> clusters;
  clusters.reserve(found.size());
  for (pcl::PointIndices& cluster : found) {
    std::sort(cluster.indices.begin(), cluster.indices.end());
    clusters.emplace_back(cluster.indices.begin(), cluster.indices.end());
  }
  std::sort(clusters.begin(), clusters.end());
  return clusters;
}

}  // namespace dsg::ingest
