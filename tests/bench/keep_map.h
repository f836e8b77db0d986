// SPDX-License-Identifier: Apache-2.0
// A map that is kept for long, to measure what keeping costs: a graph of W2's kind, and revisions
// of 500 changes to it. Refuses to be small: costs that grow with the map must show.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/random.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {

inline constexpr char kKeepMap[] = "kept";
/// Nodes, edges and poses of one revision: 500 together.
inline constexpr int kChangedNodeCount = 300;
inline constexpr int kChangedEdgeCount = 150;
inline constexpr int kAddedPoseCount = 50;

/// Makes revisions of the map, one after the other.
///
/// Threads: one caller at a time.
class KeepMap {
 public:
  explicit KeepMap(int64_t node_count);

  /// Makes the map in `folder`; the graph is revision 1 and the ones after it, in parts.
  absl::Status Make(const std::string& folder);
  /// The next revision: objects and places seen again, links weighed anew, the robot walked on.
  GraphDelta NextChange();
  /// One object seen again.
  GraphDelta NextSmallChange();

 private:
  void FillHeader(GraphDelta* delta);

  GraphDelta graph_;
  std::vector<size_t> seen_;
  std::vector<size_t> links_;
  TimedPose robot_;
  int64_t sequence_ = 0;
  Random random_;
};

}  // namespace dsg::bench
