// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/believed_paths.h"

#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

// Errors of turn count by what they do at this distance, which ranks paths; any choice is sound, so
// that it is no option.
double LeverOf(const std::vector<Pose3d>& map_T_pose) {
  Eigen::AlignedBox3d box;
  for (const Pose3d& pose : map_T_pose) box.extend(pose.position);
  return box.isEmpty() ? 1.0 : 0.25 * box.diagonal().norm();
}

}  // namespace

BelievedPaths::BelievedPaths(const PoseGraph& graph, const std::vector<Pose3d>& map_T_pose,
                             const std::vector<bool>& is_believed)
    : graph_(graph),
      steps_of_(graph.poses.size()),
      covariances_(graph.edges.size(), Matrix6d::Zero()) {
  const double lever_m = LeverOf(map_T_pose);
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    if (!is_believed[e]) continue;
    const RelativePose& edge = graph.edges[e];
    const Matrix6d covariance = CovarianceOf(edge, graph.is_planar);
    const double length = covariance.topLeftCorner<3, 3>().trace() +
                          lever_m * lever_m * covariance.bottomRightCorner<3, 3>().trace();
    covariances_[e] = MovedCovariance(AdjointOf(map_T_pose[Index(edge.to)]), covariance);
    steps_of_[Index(edge.from)].push_back({edge.to, static_cast<int>(e), length});
    steps_of_[Index(edge.to)].push_back({edge.from, static_cast<int>(e), length});
  }
}

std::vector<int> BelievedPaths::Search(int source, const std::vector<int>& targets) const {
  std::vector<int> edge_to(steps_of_.size(), -1);
  std::vector<double> distance(steps_of_.size(), std::numeric_limits<double>::infinity());
  std::vector<bool> is_target(steps_of_.size(), false);
  size_t left = 0;
  for (const int target : targets) {
    left += is_target[Index(target)] ? 0 : 1;
    is_target[Index(target)] = true;
  }
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[Index(source)] = 0.0;
  queue.push({0.0, source});
  while (!queue.empty() && left > 0) {
    const auto [length, here] = queue.top();
    queue.pop();
    if (length > distance[Index(here)]) continue;
    if (is_target[Index(here)]) {
      is_target[Index(here)] = false;
      --left;
    }
    for (const Step& step : steps_of_[Index(here)]) {
      const double longer = length + step.length;
      if (longer >= distance[Index(step.there)]) continue;
      distance[Index(step.there)] = longer;
      edge_to[Index(step.there)] = step.edge;
      queue.push({longer, step.there});
    }
  }
  return edge_to;
}

std::vector<std::optional<Matrix6d>> BelievedPaths::CovariancesFrom(
    int source, const std::vector<int>& targets) const {
  const std::vector<int> edge_to = Search(source, targets);
  std::vector<std::optional<Matrix6d>> covariances;
  for (const int target : targets) {
    Matrix6d sum = Matrix6d::Zero();
    int here = target;
    while (here != source && edge_to[Index(here)] >= 0) {
      const int e = edge_to[Index(here)];
      sum += covariances_[Index(e)];
      here = graph_.edges[Index(e)].from == here ? graph_.edges[Index(e)].to
                                                 : graph_.edges[Index(e)].from;
    }
    covariances.push_back(here == source ? std::optional<Matrix6d>(sum) : std::nullopt);
  }
  return covariances;
}

}  // namespace dsg::ingest
