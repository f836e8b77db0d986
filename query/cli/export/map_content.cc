// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/map_content.h"

namespace dsg::cli {

std::string NameOf(const Node& node) { return node.name.empty() ? ToString(node.id) : node.name; }

std::unordered_map<NodeId, const Node*> NodesById(const MapContent& content) {
  std::unordered_map<NodeId, const Node*> nodes;
  nodes.reserve(content.nodes.size());
  for (const Node& node : content.nodes) nodes.emplace(node.id, &node);
  return nodes;
}

Eigen::Vector3d MiddleOf(const Node& node) {
  const bool has_middle = !node.box_node.isEmpty() && node.kind != kinds::kPlace;
  return has_middle ? node.map_T_node * node.box_node.center() : node.map_T_node.position;
}

const Eigen::Vector3d& LastOf(const Track& track) { return track.pieces.back().back(); }

}  // namespace dsg::cli
