// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/keep_map.h"

#include <algorithm>

#include "schema/base/status.h"

namespace dsg::bench {
namespace {

constexpr char kSession[] = "keep_bench";
constexpr size_t kPartSize = 100'000;

}  // namespace

KeepMap::KeepMap(int64_t node_count)
    : graph_(W2Graph(W2Size::OfNodes(node_count))), random_(42, 1) {
  for (size_t i = 0; i < graph_.nodes.size(); ++i) {
    const std::string& kind = graph_.nodes[i].kind;
    if (kind == kinds::kObject || kind == kinds::kPlace) seen_.push_back(i);
  }
  for (size_t i = 0; i < graph_.edges.size(); ++i) {
    if (graph_.edges[i].relation == relations::kTraversable) links_.push_back(i);
  }
  robot_ = graph_.appends.front().poses.back();
}

absl::Status KeepMap::Make(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kKeepMap;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kKeepMap));
  GraphDelta whole = graph_;
  FillHeader(&whole);
  for (GraphDelta& part : SplitDelta(std::move(whole), kPartSize)) {
    sequence_ = part.sequence;
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(part)).status());
  }
  return absl::OkStatus();
}

void KeepMap::FillHeader(GraphDelta* delta) {
  delta->map = kKeepMap;
  delta->session_id = kSession;
  delta->sequence = ++sequence_;
}

GraphDelta KeepMap::NextChange() {
  GraphDelta delta;
  FillHeader(&delta);
  std::vector<bool> is_taken(graph_.nodes.size(), false);
  while (delta.nodes.size() < kChangedNodeCount) {
    const size_t at = seen_[static_cast<size_t>(random_.Index(static_cast<int>(seen_.size())))];
    if (is_taken[at]) continue;
    is_taken[at] = true;
    ++graph_.nodes[at].observation_count;
    delta.nodes.push_back(graph_.nodes[at]);
  }
  // Neighbours in a row are different links.
  const size_t first =
      static_cast<size_t>(random_.Index(static_cast<int>(links_.size()) - kChangedEdgeCount));
  for (size_t i = 0; i < kChangedEdgeCount; ++i) {
    Edge& edge = graph_.edges[links_[first + i]];
    edge.weight = random_.Uniform(0.2, 2.0);
    delta.edges.push_back(edge);
  }
  TrajectoryAppend walk{W2Robot(), {}};
  for (int i = 0; i < kAddedPoseCount; ++i) {
    robot_.time_ns += kW2PosePeriodNs;
    walk.poses.push_back(robot_);
  }
  delta.appends.push_back(std::move(walk));
  return delta;
}

GraphDelta KeepMap::NextSmallChange() {
  GraphDelta delta;
  FillHeader(&delta);
  const size_t at = seen_[static_cast<size_t>(random_.Index(static_cast<int>(seen_.size())))];
  ++graph_.nodes[at].observation_count;
  delta.nodes.push_back(graph_.nodes[at]);
  return delta;
}

}  // namespace dsg::bench
