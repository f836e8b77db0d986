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

/// The whole graph, boxes fitted: places (p), rooms (R), building B0, objects (O), agent poses (a)
/// in a layer "agent_poses", and the robot with the same poses as a track and its stays.
/// The 50 mesh indices of an object are kept as text, so that nothing the peer stores is left out.
GraphDelta W2Graph();

}  // namespace dsg::bench
