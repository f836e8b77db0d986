// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/registration/feature_match.h"

#include <pcl/features/fpfh.h>
#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr int kDescriptorSize = 33;
// Columns compared at a time: the table of distances stays small.
constexpr Eigen::Index kBlockSize = 256;

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;
using Histograms = pcl::PointCloud<pcl::FPFHSignature33>;

absl::Status CheckOptions(const FeatureOptions& options) {
  const auto is_length = [](double value) { return std::isfinite(value) && value > 0.0; };
  const bool is_usable = is_length(options.normal_radius_m) &&
                         is_length(options.feature_radius_m) && options.viewpoint.allFinite() &&
                         options.distinct_share > 0.0 && options.distinct_share <= 1.0;
  if (is_usable) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("features: radius of normals ", options.normal_radius_m, " m, of features ",
                   options.feature_radius_m, " m, share ", options.distinct_share,
                   "; give lengths above 0, a finite viewpoint and a share in (0, 1]"),
      {{"field", "options"}});
}

Cloud::Ptr ToPcl(const std::vector<Eigen::Vector3d>& points) {
  Cloud::Ptr cloud(new Cloud);
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3f q = p.cast<float>();
    cloud->push_back(pcl::PointXYZ(q.x(), q.y(), q.z()));
  }
  return cloud;
}

Normals::Ptr NormalsOf(const Cloud::Ptr& cloud, const FeatureOptions& options) {
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  estimation.setRadiusSearch(options.normal_radius_m);
  const Eigen::Vector3f eye = options.viewpoint.cast<float>();
  estimation.setViewPoint(eye.x(), eye.y(), eye.z());
  Normals::Ptr normals(new Normals);
  estimation.compute(*normals);
  return normals;
}

// Points without a normal upset the histograms of their neighbours.
void DropWithoutNormal(std::vector<Eigen::Vector3d>* points, Cloud::Ptr* cloud,
                       Normals::Ptr* normals) {
  std::vector<Eigen::Vector3d> kept;
  Normals::Ptr kept_normals(new Normals);
  for (size_t i = 0; i < points->size(); ++i) {
    const pcl::Normal& normal = (**normals)[i];
    if (!normal.getNormalVector3fMap().allFinite()) continue;
    kept.push_back((*points)[i]);
    kept_normals->push_back(normal);
  }
  *points = std::move(kept);
  *cloud = ToPcl(*points);
  *normals = kept_normals;
}

Histograms HistogramsOf(const Cloud::Ptr& cloud, const Normals::Ptr& normals,
                        const FeatureOptions& options) {
  pcl::FPFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputNormals(normals);
  estimation.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  estimation.setRadiusSearch(options.feature_radius_m);
  Histograms histograms;
  estimation.compute(histograms);
  return histograms;
}

// An empty histogram belongs to a point without neighbours.
bool IsDescribed(const Eigen::VectorXf& histogram) {
  return histogram.allFinite() && histogram.sum() > 0.0F;
}

Features Select(const Features& features, const std::vector<int>& kept) {
  Features selected;
  selected.descriptors = features.descriptors(Eigen::all, kept);
  for (const int i : kept) selected.points.push_back(features.points[i]);
  return selected;
}

Features KeepDistinct(const Features& features, double share) {
  const Eigen::Index count = features.descriptors.cols();
  if (count == 0 || share >= 1.0) return features;
  const Eigen::VectorXf mean = features.descriptors.rowwise().mean();
  std::vector<std::pair<float, int>> by_distance;
  for (Eigen::Index i = 0; i < count; ++i) {
    by_distance.emplace_back(-(features.descriptors.col(i) - mean).squaredNorm(), i);
  }
  std::sort(by_distance.begin(), by_distance.end());
  by_distance.resize(static_cast<size_t>(std::ceil(share * static_cast<double>(count))));
  std::vector<int> kept;
  for (const auto& [distance, i] : by_distance) kept.push_back(i);
  std::sort(kept.begin(), kept.end());
  return Select(features, kept);
}

struct Nearest {
  std::vector<int> index;
  std::vector<float> distance2;
};

// Of each column of `from`, the nearest column of `to`.
Nearest FindNearest(const Eigen::MatrixXf& from, const Eigen::MatrixXf& to) {
  Nearest nearest;
  const Eigen::VectorXf lengths2 = to.colwise().squaredNorm().transpose();
  for (Eigen::Index begin = 0; begin < from.cols(); begin += kBlockSize) {
    const Eigen::Index count = std::min(kBlockSize, from.cols() - begin);
    const Eigen::MatrixXf block = from.middleCols(begin, count);
    const Eigen::MatrixXf table = (-2.0F * (to.transpose() * block)).colwise() + lengths2;
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::Index best = 0;
      const float value = table.col(i).minCoeff(&best);
      nearest.index.push_back(static_cast<int>(best));
      nearest.distance2.push_back(value + block.col(i).squaredNorm());
    }
  }
  return nearest;
}

}  // namespace

absl::StatusOr<Features> DescribeCloud(const std::vector<Eigen::Vector3d>& cloud,
                                       const FeatureOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  DSG_ASSIGN_OR_RETURN(std::vector<Eigen::Vector3d> points, ThinCloud(cloud, options.spacing_m));
  Features all;
  all.descriptors.resize(kDescriptorSize, 0);
  if (points.empty()) return all;
  Cloud::Ptr thinned = ToPcl(points);
  Normals::Ptr normals = NormalsOf(thinned, options);
  DropWithoutNormal(&points, &thinned, &normals);
  if (points.empty()) return all;
  const Histograms histograms = HistogramsOf(thinned, normals, options);
  all.points = std::move(points);
  all.descriptors.resize(kDescriptorSize, static_cast<Eigen::Index>(histograms.size()));
  std::vector<int> described;
  for (size_t i = 0; i < histograms.size(); ++i) {
    const Eigen::Map<const Eigen::VectorXf> histogram(histograms[i].histogram, kDescriptorSize);
    all.descriptors.col(static_cast<Eigen::Index>(i)) = histogram;
    if (IsDescribed(histogram)) described.push_back(static_cast<int>(i));
  }
  return KeepDistinct(Select(all, described), options.distinct_share);
}

std::vector<Correspondence> MatchMutually(const Features& source, const Features& target,
                                          int count_max) {
  if (source.points.empty() || target.points.empty() || count_max <= 0) return {};
  const Nearest forth = FindNearest(source.descriptors, target.descriptors);
  const Nearest back = FindNearest(target.descriptors, source.descriptors);
  std::vector<std::pair<float, int>> mutual;
  for (size_t i = 0; i < forth.index.size(); ++i) {
    if (back.index[forth.index[i]] != static_cast<int>(i)) continue;
    mutual.emplace_back(forth.distance2[i], static_cast<int>(i));
  }
  std::sort(mutual.begin(), mutual.end());
  if (mutual.size() > static_cast<size_t>(count_max)) mutual.resize(count_max);
  std::vector<Correspondence> matches;
  for (const auto& [distance2, i] : mutual) matches.emplace_back(i, forth.index[i]);
  return matches;
}

}  // namespace dsg::ingest
