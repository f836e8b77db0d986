// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/keypoints.h"

#include <pcl/keypoints/harris_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "ingest/objects/shapes/surface.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {
namespace {

// Numerical, no option: less than this and no normal can be told.
constexpr size_t kNormalPointCountMin = 8;

std::vector<Eigen::Vector3d> FindCorners(const std::vector<Eigen::Vector3d>& points,
                                         const KeypointOptions& options) {
  // Single precision far from the origin would blur the normals.
  const Eigen::Vector3d origin = points.front();
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3f local = (point - origin).cast<float>();
    cloud->push_back(pcl::PointXYZ(local.x(), local.y(), local.z()));
  }
  pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI> harris(
      pcl::HarrisKeypoint3D<pcl::PointXYZ, pcl::PointXYZI>::HARRIS,
      static_cast<float>(options.radius_m), static_cast<float>(options.threshold));
  harris.setNonMaxSupression(true);
  // Refined corners may lie anywhere on the crossing of two noisy planes.
  harris.setRefine(false);
  harris.setNumberOfThreads(1);
  harris.setInputCloud(cloud);
  pcl::PointCloud<pcl::PointXYZI> found;
  harris.compute(found);
  std::vector<pcl::PointXYZI> corners;
  for (const pcl::PointXYZI& corner : found) {
    if (std::isfinite(corner.intensity) && corner.getVector3fMap().allFinite()) {
      corners.push_back(corner);
    }
  }
  std::sort(corners.begin(), corners.end(), [](const auto& a, const auto& b) {
    return std::tie(b.intensity, a.x, a.y, a.z) < std::tie(a.intensity, b.x, b.y, b.z);
  });
  std::vector<Eigen::Vector3d> out;
  for (const pcl::PointXYZI& corner : corners) {
    out.emplace_back(origin + corner.getVector3fMap().cast<double>());
  }
  return out;
}

std::vector<Eigen::Vector3d> SpreadPoints(const std::vector<Eigen::Vector3d>& points,
                                          size_t count_max) {
  Box3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  double cell_m = std::max(0.05, 0.05 * box.diagonal().norm());
  std::vector<Eigen::Vector3d> out = ThinPoints(points, cell_m);
  while (out.size() > count_max) {
    cell_m *= 1.2;
    out = ThinPoints(points, cell_m);
  }
  return out;
}

}  // namespace

std::vector<Eigen::Vector3d> FindKeypoints(const std::vector<Eigen::Vector3d>& points,
                                           const KeypointOptions& options) {
  const auto count_max = static_cast<size_t>(std::max(options.count_max, 1));
  if (points.size() < kNormalPointCountMin) return points;
  std::vector<Eigen::Vector3d> corners = FindCorners(points, options);
  if (corners.size() < static_cast<size_t>(options.count_min)) {
    return SpreadPoints(points, count_max);
  }
  if (corners.size() > count_max) corners.resize(count_max);
  return corners;
}

}  // namespace dsg::ingest
