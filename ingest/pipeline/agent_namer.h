// SPDX-License-Identifier: Apache-2.0
// Gives agents their ids: the same name and kind is the same agent, in a log and across logs.
// Refuses to reuse an id that the map or the log has given to another name.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "schema/model/graph_delta.h"
#include "schema/model/node.h"

namespace dsg::ingest {

/// Deterministic: the same known agents and the same calls give the same ids; agents of an
/// interrupted run are found again by name, so a resumed run names as an undisturbed one.
class AgentNamer {
 public:
  /// `known`: the agents of the map.
  explicit AgentNamer(const std::vector<Node>& known);

  /// The id of a known agent; otherwise a new one: letter H for humans and r for robots, and for
  /// a name that is an integer below a million that index if it is free, for one that reads as an
  /// id of that letter this id if it is free, else the index above the largest.
  NodeId Assign(std::string_view name, std::string_view kind);

  /// As Assign, but a new agent keeps `preferred` if it is free.
  NodeId AssignPreferring(NodeId preferred, std::string_view name, std::string_view kind);

  /// The agents asked for whose name reads as an id that is not theirs, by name. Who asks for such
  /// a word gets the agent with that id.
  const std::map<std::string, NodeId>& misleading() const { return misleading_; }

 private:
  NodeId FindOrTake(NodeId preferred, std::string_view name, std::string_view kind);
  NodeId Take(NodeId id, std::string_view name, std::string_view kind);

  std::map<std::pair<std::string, std::string>, NodeId, std::less<>> id_of_;
  std::unordered_set<NodeId> taken_;
  std::map<char, uint64_t> largest_index_;
  std::map<std::string, NodeId> misleading_;
};

/// Gives each agent of `delta` the id that `namer` has for its name, its own if that is free, in
/// every part of the delta.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED when two agents of the graph share name and kind.
absl::Status RenameAgents(AgentNamer* namer, GraphDelta* delta);

}  // namespace dsg::ingest
