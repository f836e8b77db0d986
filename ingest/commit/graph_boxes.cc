// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/graph_boxes.h"

#include <set>
#include <unordered_map>
#include <unordered_set>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using ParentsOf = std::unordered_map<NodeId, std::set<NodeId>>;

ParentsOf NamedParents(const GraphDelta& delta) {
  ParentsOf parents;
  for (const Edge& edge : delta.edges) {
    if (edge.relation == relations::kContains) parents[edge.target].insert(edge.source);
  }
  return parents;
}

// Stored nodes that may have children: the delta's own, and those of the layers of parents, which
// the delta may have forgotten.
absl::StatusOr<std::set<NodeId>> StoredParents(const MapView& map, const GraphDelta& delta) {
  std::set<NodeId> ids;
  for (const LayerId layer : {layers::kPlaces, layers::kRooms, layers::kBuildings}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Node> nodes, map.NodesOfLayer(layer));
    for (const Node& node : nodes) ids.insert(node.id);
  }
  for (const Node& node : delta.nodes) ids.insert(node.id);
  std::set<NodeId> stored;
  for (const NodeId id : ids) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Node> node, map.FindNode(id));
    if (node.has_value() && !IsAgentKind(node->kind)) stored.insert(id);
  }
  return stored;
}

// Stored edges that the delta contradicts by silence: it speaks of both ends and of this relation,
// or it names another nearest place of the same node.
absl::Status EndUnnamedEdges(const MapView& map, const std::unordered_set<NodeId>& own,
                             GraphDelta* delta) {
  std::set<EdgeKey> named;
  std::set<std::string> spoken;
  std::unordered_set<NodeId> placed;
  for (const Edge& edge : delta->edges) {
    named.insert(edge.key());
    spoken.insert(edge.relation);
    if (edge.relation == relations::kNearestPlace) placed.insert(edge.source);
  }
  for (const NodeId source : own) {
    DSG_ASSIGN_OR_RETURN(const std::vector<Edge> stored, map.EdgesFrom(source));
    for (const Edge& edge : stored) {
      const bool is_other_place =
          edge.relation == relations::kNearestPlace && placed.contains(source);
      const bool is_spoken_of = spoken.contains(edge.relation) && own.contains(edge.target);
      if (edge.relation == relations::kContains || named.contains(edge.key())) continue;
      if (is_other_place || is_spoken_of) delta->edge_removals.push_back(edge.key());
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status LayOverStoredGraph(const MapView& map, GraphDelta* delta) {
  const size_t node_count = delta->nodes.size();
  const size_t edge_count = delta->edges.size();
  const ParentsOf named = NamedParents(*delta);
  std::unordered_set<NodeId> own;
  for (const Node& node : delta->nodes) own.insert(node.id);
  std::unordered_set<NodeId> present = own;
  DSG_ASSIGN_OR_RETURN(const std::set<NodeId> parents, StoredParents(map, *delta));
  // The stored children that stay join the delta for as long as the fitting takes.
  for (const NodeId parent : parents) {
    DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> children, map.Children(parent));
    for (const NodeId child : children) {
      const auto claimed = named.find(child);
      if (claimed != named.end() && !claimed->second.contains(parent)) {
        delta->edge_removals.push_back({parent, relations::kContains, child});
        continue;
      }
      if (!own.contains(parent)) continue;
      Edge contains;
      contains.source = parent;
      contains.relation = relations::kContains;
      contains.target = child;
      delta->edges.push_back(contains);
      if (!present.insert(child).second) continue;
      DSG_ASSIGN_OR_RETURN(std::optional<Node> node, map.FindNode(child));
      if (node.has_value()) delta->nodes.push_back(*std::move(node));
    }
  }
  if (delta->edges.size() > edge_count) FitBoxesToChildren(delta);
  delta->nodes.resize(node_count);
  delta->edges.resize(edge_count);
  return EndUnnamedEdges(map, own, delta);
}

}  // namespace dsg::ingest
