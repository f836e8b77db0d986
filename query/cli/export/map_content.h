// SPDX-License-Identifier: Apache-2.0
// The content of a map that is drawn or written to a file, as plain values, and the part of it on
// one floor. It may come from a store, a server or a test.
#pragma once

#include <Eigen/Core>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/export/body.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {

/// The track of an agent.
struct Track {
  NodeId agent;
  /// Without standstill; a new piece begins after each gap. Map frame, metres.
  std::vector<std::vector<Eigen::Vector3d>> pieces;
  /// All poses, if asked for.
  std::vector<TimedPose> poses;
};

struct MapContent {
  MapSpec spec;
  Revision revision = 0;
  /// Ascending by rank. Ids of layers that the map added are arbitrary, but differ.
  std::vector<Layer> layers;
  /// Ascending by id.
  std::vector<Node> nodes;
  /// Both ends are among the nodes.
  std::vector<Edge> edges;
  /// Of the agents that have poses, ascending by id.
  std::vector<Track> tracks;
  std::vector<MeshBlock> mesh;
  /// Of the agents that have some, if asked for.
  std::vector<AgentBodies> bodies;
};

/// "office 4"; the id of a node without a name.
std::string NameOf(const Node& node);

/// Nodes by id; points into `content`.
std::unordered_map<NodeId, const Node*> NodesById(const MapContent& content);

/// What contains each node, by its id; points into `content`. Nodes of the top are not in it.
std::unordered_map<NodeId, const Node*> ParentsOf(const MapContent& content);

/// The centre of the node's box; its position without a box, and for places, whose box is the free
/// space around them. Map frame.
Eigen::Vector3d MiddleOf(const Node& node);

/// Whether bodies of the agent are in the content.
bool HasBody(const MapContent& content, NodeId agent);

/// The last position of an agent. Requires: at least one piece, and no piece is empty.
const Eigen::Vector3d& LastOf(const Track& track);

/// Heights in the map frame, metres; includes both ends.
struct HeightRange {
  double low_m = 0.0;
  double high_m = 0.0;
  bool Contains(double z_m) const { return low_m <= z_m && z_m <= high_m; }
};

/// `floor` is a node's id or name (a level, a room, a building), which gives the node's heights; or
/// a height in metres, which gives the heights of the rooms that contain it, or 1.5 m around it
/// without a room. Errors: NOT_FOUND/NODE_UNKNOWN.
absl::StatusOr<HeightRange> ChooseFloor(const MapContent& content, const std::string& floor);

/// Structures that begin more than 1.8 m above their floor, as the wall over a door does: people
/// walk below them. The floor is that of the room that a structure encloses or lies in; without one
/// that of the highest room around its foot, or else the foot of the lowest structure beside it.
std::unordered_set<NodeId> StructuresOverHead(const MapContent& content);

/// The floor extended 0.3 m down: heights of tracks on the floor have errors.
HeightRange StandingHeights(const HeightRange& floor);

/// The pieces of a track within StandingHeights.
std::vector<std::vector<Eigen::Vector3d>> PiecesOnFloor(const HeightRange& floor,
                                                        const std::vector<Eigen::Vector3d>& track);

/// Drops nodes whose middle is outside, edges that lost an end, and faces outside. Tracks keep
/// PiecesOnFloor.
void KeepFloor(const HeightRange& floor, MapContent* content);

}  // namespace dsg::cli
