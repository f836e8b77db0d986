// SPDX-License-Identifier: Apache-2.0
// From the places along a track to the stays in them.
// Refuses to look for places: that is place_finder.h, or the edges of the file.
#pragma once

#include <unordered_map>
#include <vector>

#include "schema/model/graph_delta.h"

namespace dsg {

/// Where an agent was at one of its poses; place and room may be empty.
struct Visit {
  TimeNs time_ns = 0;
  NodeId place;
  NodeId room;
};

/// The place and room of each pose node, read off converted edges. Of several the lowest id.
class Whereabouts {
 public:
  explicit Whereabouts(const GraphDelta& delta);

  NodeId PlaceOf(NodeId pose) const;
  /// Of the pose's place, or of the pose itself.
  NodeId RoomOf(NodeId pose) const;
  NodeId RoomOfPlace(NodeId place) const;

 private:
  using Links = std::unordered_map<NodeId, NodeId>;

  Links place_;
  Links room_;
};

/// A stay ends when the next begins, or right after its last pose when the agent is lost for longer
/// than kStayGapNs; stays are cut at kStayNsMax. Requires: visits grow in time.
void AddStays(NodeId agent, const std::vector<Visit>& visits, std::vector<Stay>* stays);

}  // namespace dsg
