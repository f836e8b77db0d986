// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/optimize.h"
#include "ingest/loop/start.h"
#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {

std::vector<int> PartsOf(const PoseGraph& graph, const std::vector<double>& weights) {
  DisjointSets sets(graph.poses.size());
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    if (weights.empty() || weights[i] != 0.0) sets.Merge(graph.edges[i].from, graph.edges[i].to);
  }
  std::vector<int> parts(graph.poses.size());
  int part_count = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    const int first = sets.Find(static_cast<int>(i));
    parts[i] = first == static_cast<int>(i) ? part_count++ : parts[static_cast<size_t>(first)];
  }
  return parts;
}

std::vector<int> AnchorsOf(const std::vector<int>& parts, int fixed_pose) {
  std::vector<int> anchors;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (parts[i] == static_cast<int>(anchors.size())) anchors.push_back(static_cast<int>(i));
  }
  if (!parts.empty()) {
    anchors[static_cast<size_t>(parts[static_cast<size_t>(fixed_pose)])] = fixed_pose;
  }
  return anchors;
}

}  // namespace dsg::ingest
