// SPDX-License-Identifier: Apache-2.0
// All of a map that is drawn or written to a file, as plain values.
// Refuses to know where it came from: a store, a server or a test.
#pragma once

#include <Eigen/Core>
#include <string>
#include <unordered_map>
#include <vector>

#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {

/// Where an agent went.
struct Track {
  NodeId agent;
  /// Without standstill; a new piece begins after each gap. Map frame.
  std::vector<std::vector<Eigen::Vector3d>> pieces;
  /// All of it, if asked for.
  std::vector<TimedPose> poses;
};

struct MapContent {
  MapSpec spec;
  Revision revision = 0;
  /// Ascending by rank. Ids of layers that the map added are made up; they tell layers apart.
  std::vector<Layer> layers;
  /// Ascending by id.
  std::vector<Node> nodes;
  /// Both ends are among the nodes.
  std::vector<Edge> edges;
  /// Of the agents that have poses, ascending by id.
  std::vector<Track> tracks;
  std::vector<MeshBlock> mesh;
};

/// "office 4", or the id of a node without a name.
std::string NameOf(const Node& node);

/// Nodes by id; points into `content`.
std::unordered_map<NodeId, const Node*> NodesById(const MapContent& content);

/// Where a node stands: the middle of its box; its position when it has none, and for places, whose
/// box is the free space around them.
Eigen::Vector3d MiddleOf(const Node& node);

/// Where an agent was last. Requires: no piece is empty, and there is one.
const Eigen::Vector3d& LastOf(const Track& track);

}  // namespace dsg::cli
