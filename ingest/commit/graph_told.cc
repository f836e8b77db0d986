// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/graph_told.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

std::string VersionOf(const Node& node) { return EncodeNodePayload(node); }

std::string VersionOf(const Edge& edge) {
  return absl::StrCat(edge.weight, "\n", EncodeEdgePayload(edge));
}

}  // namespace

GraphDelta GraphTold::Tell(LayerGraph now) {
  GraphDelta delta;
  std::map<NodeId, std::string> nodes;
  for (Node& node : now.nodes) {
    std::string version = VersionOf(node);
    const auto told = nodes_.find(node.id);
    const bool is_news = told == nodes_.end() || told->second != version;
    nodes[node.id] = std::move(version);
    if (is_news) delta.nodes.push_back(std::move(node));
  }
  for (const auto& [id, version] : nodes_) {
    if (!nodes.contains(id)) delta.retirements.push_back({id, std::nullopt});
  }
  std::map<EdgeKey, std::string> edges;
  for (Edge& edge : now.edges) {
    std::string version = VersionOf(edge);
    const EdgeKey key = edge.key();
    const auto told = edges_.find(key);
    const bool is_news = told == edges_.end() || told->second != version;
    edges[key] = std::move(version);
    if (is_news) delta.edges.push_back(std::move(edge));
  }
  for (const auto& [key, version] : edges_) {
    if (!edges.contains(key)) delta.edge_removals.push_back(key);
  }
  nodes_ = std::move(nodes);
  edges_ = std::move(edges);
  Coalesce(&delta);
  return delta;
}

}  // namespace dsg::ingest
