// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/odometry_tree.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

std::vector<std::vector<int>> OdometryOfPoses(const PoseGraph& graph) {
  std::vector<std::vector<int>> edges_of(graph.poses.size());
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    const RelativePose& edge = graph.edges[e];
    if (edge.is_loop || edge.from == edge.to) continue;
    edges_of[static_cast<size_t>(edge.from)].push_back(static_cast<int>(e));
    edges_of[static_cast<size_t>(edge.to)].push_back(static_cast<int>(e));
  }
  return edges_of;
}

}  // namespace

OdometryTree::OdometryTree(const PoseGraph& graph)
    : part_(graph.poses.size(), -1),
      part_T_pose_(graph.poses.size()),
      covariance_(graph.poses.size(), Matrix6d::Zero()),
      rotation_variance_(graph.poses.size(), 0.0),
      parent_(graph.poses.size(), -1),
      place_(graph.poses.size(), 0),
      depth_(graph.poses.size(), 0) {
  Grow(graph);
  NumberInDepthOrder();
}

void OdometryTree::Grow(const PoseGraph& graph) {
  const std::vector<std::vector<int>> edges_of = OdometryOfPoses(graph);
  int part_count = 0;
  for (size_t root = 0; root < part_.size(); ++root) {
    if (part_[root] >= 0) continue;
    part_[root] = part_count++;
    size_t next = grown_.size();
    grown_.push_back(static_cast<int>(root));
    while (next < grown_.size()) {
      const int here = grown_[next++];
      for (const int e : edges_of[Index(here)]) {
        const RelativePose& edge = graph.edges[Index(e)];
        const bool is_forward = edge.from == here;
        const int there = is_forward ? edge.to : edge.from;
        if (part_[Index(there)] >= 0) continue;
        part_[Index(there)] = part_[root];
        parent_[Index(there)] = here;
        depth_[Index(there)] = depth_[Index(here)] + 1;
        part_T_pose_[Index(there)] =
            part_T_pose_[Index(here)] * (is_forward ? edge.from_T_to : edge.from_T_to.Inverse());
        part_T_pose_[Index(there)].orientation.normalize();
        const Matrix6d covariance = CovarianceOf(edge, graph.is_planar);
        // The noise is a twist of the pose that the edge leads to, whichever way it is walked.
        const Matrix6d adjoint = AdjointOf(part_T_pose_[Index(edge.to)]);
        covariance_[Index(there)] = covariance_[Index(here)] + MovedCovariance(adjoint, covariance);
        rotation_variance_[Index(there)] =
            rotation_variance_[Index(here)] + covariance.bottomRightCorner<3, 3>().trace();
        grown_.push_back(there);
      }
    }
  }
}

void OdometryTree::NumberInDepthOrder() {
  // Sizes of subtrees give each pose its place in depth-first order without walking it.
  std::vector<int> size(part_.size(), 1);
  for (size_t k = grown_.size(); k-- > 0;) {
    const int pose = grown_[k];
    if (parent_[Index(pose)] >= 0) size[Index(parent_[Index(pose)])] += size[Index(pose)];
  }
  std::vector<int> next_place(part_.size(), 0);
  int next_root_place = 0;
  std::vector<int> parents(part_.size(), -1);
  for (const int pose : grown_) {
    const int parent = parent_[Index(pose)];
    int& next = parent < 0 ? next_root_place : next_place[Index(parent)];
    place_[Index(pose)] = next;
    next += size[Index(pose)];
    next_place[Index(pose)] = place_[Index(pose)] + 1;
    parents[Index(place_[Index(pose)])] = parent;
  }
  shallowest_.push_back(std::move(parents));
  for (size_t width = 1; 2 * width <= part_.size(); width *= 2) {
    const std::vector<int>& half = shallowest_.back();
    std::vector<int> row(part_.size() - 2 * width + 1);
    for (size_t i = 0; i < row.size(); ++i) {
      const int a = half[i];
      const int b = half[i + width];
      row[i] = a < 0 || b < 0 ? -1 : (depth_[Index(a)] <= depth_[Index(b)] ? a : b);
    }
    shallowest_.push_back(std::move(row));
  }
}

int OdometryTree::MeetingPose(int a, int b) const {
  if (a == b) return a;
  const auto [low, high] = std::minmax(place_[Index(a)], place_[Index(b)]);
  const uint32_t width = static_cast<uint32_t>(high - low);
  const int level = std::bit_width(width) - 1;
  const std::vector<int>& row = shallowest_[Index(level)];
  const int first = row[Index(low + 1)];
  const int second = row[Index(high + 1 - (1 << level))];
  return depth_[Index(first)] <= depth_[Index(second)] ? first : second;
}

Matrix6d OdometryTree::CovarianceBetween(int a, int b) const {
  return covariance_[Index(a)] + covariance_[Index(b)] -
         2.0 * covariance_[Index(MeetingPose(a, b))];
}

double OdometryTree::RotationVarianceBetween(int a, int b) const {
  return rotation_variance_[Index(a)] + rotation_variance_[Index(b)] -
         2.0 * rotation_variance_[Index(MeetingPose(a, b))];
}

}  // namespace dsg::ingest
