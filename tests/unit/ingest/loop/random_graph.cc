// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/loop/random_graph.h"

#include <algorithm>

#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

Eigen::Vector3d RandomVector(double range, Random* random) {
  return {random->Uniform(-range, range), random->Uniform(-range, range),
          random->Uniform(-range, range)};
}

RelativePose Measure(const PoseGraph& graph, int from, int to, const RandomGraphOptions& options,
                     Random* random) {
  RelativePose edge;
  edge.from = from;
  edge.to = to;
  edge.is_loop = std::abs(from - to) != 1;
  Pose3d noise{options.noise_m * Eigen::Vector3d(random->Normal(), random->Normal(), 0.0)};
  Eigen::Vector3d turn(0.0, 0.0, options.noise_rad * random->Normal());
  if (!graph.is_planar) {
    noise.position.z() = options.noise_m * random->Normal();
    turn.head<2>() = options.noise_rad * Eigen::Vector2d(random->Normal(), random->Normal());
  }
  noise.orientation = RotationOf(turn);
  edge.from_T_to = graph.poses[static_cast<size_t>(from)].Inverse() *
                   graph.poses[static_cast<size_t>(to)] * noise;
  edge.information = RandomInformation(graph.is_planar, random);
  return edge;
}

}  // namespace

Pose3d RandomPose(bool is_planar, double range_m, double range_rad, Random* random) {
  Eigen::Vector3d position = RandomVector(range_m, random);
  Eigen::Vector3d turn = RandomVector(range_rad, random);
  if (is_planar) {
    position.z() = 0.0;
    turn.head<2>().setZero();
  }
  return {position, RotationOf(turn)};
}

Matrix6d RandomInformation(bool is_planar, Random* random) {
  Matrix6d half;
  for (double& value : half.reshaped()) value = random->Normal();
  const Matrix6d whole = half * half.transpose() + Matrix6d::Identity();
  if (!is_planar) return whole;
  Matrix6d planar = Matrix6d::Identity();
  for (const int r : {0, 1, 5}) {
    for (const int c : {0, 1, 5}) planar(r, c) = whole(r, c);
  }
  return planar;
}

PoseGraph RandomGraph(const RandomGraphOptions& options, Random* random) {
  PoseGraph graph;
  graph.is_planar = options.is_planar;
  Pose3d pose = RandomPose(options.is_planar, 5.0, 1.0, random);
  for (int i = 0; i < options.pose_count; ++i) {
    graph.ids.push_back(i);
    graph.poses.push_back(pose);
    pose = pose * RandomPose(options.is_planar, 1.0, 0.5, random);
    pose.orientation.normalize();
  }
  for (int i = 1; i < options.pose_count; ++i) {
    graph.edges.push_back(Measure(graph, i - 1, i, options, random));
  }
  for (int i = 0; i < options.loop_count; ++i) {
    const int from = random->Index(options.pose_count);
    const int to = random->Index(options.pose_count);
    if (std::abs(from - to) < 2) continue;
    graph.edges.push_back(Measure(graph, from, to, options, random));
  }
  return graph;
}

std::vector<Pose3d> Moved(const Pose3d& map_T_old, const std::vector<Pose3d>& poses) {
  std::vector<Pose3d> moved;
  for (const Pose3d& pose : poses) moved.push_back(map_T_old * pose);
  return moved;
}

double LargestDifference(const std::vector<Pose3d>& a, const std::vector<Pose3d>& b) {
  if (a.size() != b.size()) return 1e9;
  double largest = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    largest = std::max({largest, (a[i].position - b[i].position).norm(),
                        AngleBetween(a[i].orientation, b[i].orientation)});
  }
  return largest;
}

}  // namespace dsg::ingest
