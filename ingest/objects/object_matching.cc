// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_matching.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <tuple>

#include "ingest/objects/point_index.h"

namespace dsg::ingest {
namespace {

double Overlap(const Box3d& a, const Box3d& b) {
  const Box3d both = a.intersection(b);
  if (both.isEmpty()) return 0.0;
  return both.volume() / (a.volume() + b.volume() - both.volume());
}

Box3d Widened(const Box3d& box, double slack_m) {
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(slack_m);
  return Box3d(box.min() - slack, box.max() + slack);
}

struct Candidate {
  int rank = 0;
  double score = 0.0;
  int object = -1;
  int cluster = -1;
};

std::optional<Candidate> Compare(const ObjectCluster& object, const Box3d& object_box,
                                 const ObjectCluster& cluster, const Box3d& cluster_box,
                                 const MatchOptions& options) {
  const double distance_m = (object.center_map - cluster.center_map).norm();
  const double overlap = Overlap(object_box, cluster_box);
  Candidate candidate;
  candidate.score = overlap - 0.1 * distance_m;
  if (object.instance_id != 0 && object.instance_id == cluster.instance_id &&
      distance_m <= options.instance_reach_m + 0.5 * object_box.diagonal().norm()) {
    return candidate;
  }
  candidate.rank = 1;
  if (object.class_id == cluster.class_id) {
    const bool is_same = overlap >= options.overlap_min || distance_m <= options.center_reach_m ||
                         object_box.contains(cluster.center_map) ||
                         cluster_box.contains(object.center_map);
    if (is_same) return candidate;
    return std::nullopt;
  }
  candidate.rank = 2;
  if (overlap >= options.other_class_overlap_min) return candidate;
  return std::nullopt;
}

std::vector<Candidate> CandidatesOf(const std::vector<TrackedObject>& objects,
                                    const std::vector<ObjectCluster>& clusters,
                                    const MatchOptions& options) {
  std::vector<Box3d> cluster_boxes;
  for (const ObjectCluster& cluster : clusters) {
    cluster_boxes.push_back(Widened(AxisAlignedBox(cluster), options.box_slack_m));
  }
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < objects.size(); ++i) {
    const Box3d box = Widened(AxisAlignedBox(objects[i].cluster), options.box_slack_m);
    for (size_t j = 0; j < clusters.size(); ++j) {
      auto candidate = Compare(objects[i].cluster, box, clusters[j], cluster_boxes[j], options);
      if (!candidate.has_value()) continue;
      candidate->object = static_cast<int>(i);
      candidate->cluster = static_cast<int>(j);
      candidates.push_back(*candidate);
    }
  }
  return candidates;
}

double YawOf(const ObjectCluster& cluster) {
  const Eigen::Vector3d x = cluster.map_T_box.orientation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

/// Share of the points of `object` that are within `distance_m` of those of `cluster`.
double SharedPoints(const ObjectCluster& object, const PointIndex& cluster, double distance_m) {
  const auto count = std::count_if(
      object.points_map.begin(), object.points_map.end(), [&](const Eigen::Vector3f& point) {
        const PointIndex::Hit hit = cluster.Nearest(point);
        return hit.index >= 0 && static_cast<double>(hit.distance_m) <= distance_m;
      });
  return static_cast<double>(count) / static_cast<double>(object.points_map.size());
}

}  // namespace

Box3d AxisAlignedBox(const ObjectCluster& cluster) {
  return TransformBox(cluster.map_T_box, Box3d(-0.5 * cluster.size, 0.5 * cluster.size));
}

std::vector<int> MatchClusters(const std::vector<TrackedObject>& objects,
                               const std::vector<ObjectCluster>& clusters,
                               const MatchOptions& options) {
  std::vector<Candidate> candidates = CandidatesOf(objects, clusters, options);
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(a.rank, -a.score, a.object, a.cluster) <
           std::tuple(b.rank, -b.score, b.object, b.cluster);
  });
  std::vector<int> object_of(clusters.size(), -1);
  std::vector<bool> is_taken(objects.size(), false);
  for (const Candidate& candidate : candidates) {
    const auto object = static_cast<size_t>(candidate.object);
    const auto cluster = static_cast<size_t>(candidate.cluster);
    if (is_taken[object] || object_of[cluster] >= 0) continue;
    is_taken[object] = true;
    object_of[cluster] = candidate.object;
  }
  return object_of;
}

bool IsChanged(const ObjectCluster& before, const ObjectCluster& after,
               const MatchOptions& options) {
  if (before.class_id != after.class_id || before.instance_id != after.instance_id) return true;
  if ((before.center_map - after.center_map).norm() > options.center_change_m) return true;
  const double turn_rad = YawOf(after) - YawOf(before);
  Eigen::Vector3d size = after.size;
  // Yaw runs from -45 to 45 degrees; past the end the sides change places.
  if (std::abs(turn_rad) > M_PI / 4.0) std::swap(size.x(), size.y());
  if (std::abs(std::remainder(turn_rad, M_PI / 2.0)) > options.yaw_change_rad) return true;
  return (before.size - size).cwiseAbs().maxCoeff() > options.size_change_m;
}

int AbsorbingCluster(const ObjectCluster& object, const std::vector<ObjectCluster>& clusters,
                     const MatchOptions& options) {
  if (object.points_map.empty()) return -1;
  const Box3d box = Widened(AxisAlignedBox(object), options.box_slack_m);
  int best = -1;
  double best_share = 0.0;
  for (size_t i = 0; i < clusters.size(); ++i) {
    if (!box.intersects(Widened(AxisAlignedBox(clusters[i]), options.box_slack_m))) continue;
    const bool is_same_class = clusters[i].class_id == object.class_id;
    const PointIndex points(clusters[i].points_map);
    const double share =
        SharedPoints(object, points, is_same_class ? options.own_point_m : options.same_point_m);
    if (share < (is_same_class ? options.own_share_min : options.same_share_min) ||
        share <= best_share)
      continue;
    best_share = share;
    best = static_cast<int>(i);
  }
  return best;
}

uint64_t DigestOf(const ObjectCluster& cluster) {
  uint64_t digest = 0xcbf29ce484222325u;
  for (const Eigen::Vector3f& point : cluster.points_map) {
    for (int axis = 0; axis < 3; ++axis) {
      digest = (digest ^ std::bit_cast<uint32_t>(point[axis])) * 0x100000001b3u;
    }
  }
  return digest;
}

}  // namespace dsg::ingest
