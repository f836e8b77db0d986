// SPDX-License-Identifier: Apache-2.0
// Agents of Spark-DSG: poses that are nodes of a file as robots with trajectories and stays, and
// what is shared with people, whose ways are fields of a node.
#pragma once

#include <Eigen/Core>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/model/graph_delta.h"
#include "schema/model/node.h"

namespace dsg {

/// A pose edge that leads to the nearest place is NEAREST_PLACE; one to any other layer is this.
inline constexpr char kPoseIn[] = "POSE_IN";

/// Poses of one robot further apart than this are no stay; the default gap of a map.
inline constexpr TimeNs kStayGapNs = 2 * kNsPerSecond;

/// Adds to `delta`, which holds the converted nodes and edges, one robot for each letter of pose
/// ids: r0 for a, r1 for b and so on, or the next id that is free; named by the letter. Its track
/// has the poses with a time, in order of their ids; of equal or backward times the first stays.
/// Its stays follow the poses' places; see AddStays. Sentences about what was left out are appended
/// to `notes`.
void AddSparkAgents(const SparkGraph& graph, GraphDelta* delta, std::vector<std::string>* notes);

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

/// The place nearest to a point, up to 4 m: beyond, a place says nothing about a pose.
/// Cost: a search in the order of x; fine for some ten thousand places.
class PlaceFinder {
 public:
  explicit PlaceFinder(const std::vector<Node>& nodes);

  /// The empty id if there is none; of several equally near the lowest.
  NodeId Nearest(const Eigen::Vector3d& point_map) const;

 private:
  std::vector<std::pair<Eigen::Vector3d, NodeId>> places_;
};

}  // namespace dsg
