// SPDX-License-Identifier: Apache-2.0
// W2, the synthetic graph on which Spark-DSG 1.1.3 was measured: 120,101 nodes and 418,099 edges,
// deterministic. A robot with the poses as its track comes on top, which is how we keep agents.
#pragma once

#include <cstdint>

#include "schema/model/graph_delta.h"

namespace dsg::bench {

/// As generated there.
inline constexpr int64_t kW2NodeCount = 120'101;
inline constexpr int64_t kW2EdgeCount = 418'099;
/// Bytes of the same graph in the peer's binary file, without history.
inline constexpr int64_t kW2PeerBytes = 60'603'219;

inline constexpr int kW2PlaceCount = 100'000;
inline constexpr int kW2ObjectCount = 10'000;
inline constexpr int kW2PoseCount = 10'000;
inline constexpr TimeNs kW2PosePeriodNs = kNsPerSecond / 10;

NodeId W2Robot();

/// Places along a side of W2's building, which is ten places high.
inline constexpr int kW2SideCount = 100;

/// How large the building is that a graph of W2's kind is made of; rooms, objects and poses grow
/// with its area, so that each room holds what a room of W2 does.
struct W2Size {
  /// Multiple of 10.
  int side_count = kW2SideCount;

  /// The size whose graph has about so many nodes.
  static W2Size OfNodes(int64_t node_count);

  double side_m() const { return 0.5 * side_count; }
  int rooms_per_side() const { return side_count / 10; }
  int place_count() const { return side_count * side_count * 10; }
  int object_count() const { return side_count * side_count; }
  int pose_count() const { return side_count * side_count; }
};

/// The whole graph, boxes fitted: places (p), rooms (R), building B0, objects (O), agent poses (a)
/// in a layer "agent_poses", and the robot with the same poses as a track and its stays.
/// The 50 mesh indices of an object are kept as text, so that nothing the peer stores is left out.
GraphDelta W2Graph(const W2Size& size = {});

/// Names the objects' classes, which W2 has by number only: "class_0" to "class_19".
void NameW2Classes(GraphDelta* graph);

}  // namespace dsg::bench
