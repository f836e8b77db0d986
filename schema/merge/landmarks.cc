// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/landmarks.h"

#include <algorithm>
#include <map>

#include "absl/strings/str_cat.h"

namespace dsg::merge {
namespace {

// The middle of what was seen; a node's own position may be a foot or a corner.
Eigen::Vector3d MiddleOf(const Node& node) {
  return node.box_node.isEmpty() ? node.map_T_node.position
                                 : Eigen::Vector3d(node.map_T_node * node.box_node.center());
}

double DiagonalOf(const Node& node) {
  return node.box_node.isEmpty() ? 0.0 : node.box_node.sizes().norm();
}

}  // namespace

std::vector<Landmark> LandmarksOf(const MapContent& content, bool with_regions) {
  std::vector<Landmark> landmarks;
  for (int i = 0; i < static_cast<int>(content.nodes.size()); ++i) {
    const Node& node = content.nodes[static_cast<size_t>(i)];
    if (node.valid.to_ns != kTimeMax) continue;
    const NodeClass node_class = content.ClassOf(i);
    if (node_class == NodeClass::kObject && !ClassKey(node).empty()) {
      landmarks.push_back({"o " + ClassKey(node), MiddleOf(node), DiagonalOf(node)});
    } else if (with_regions && node_class == NodeClass::kRegion && node.kind == kinds::kRoom) {
      landmarks.push_back({"r " + ClassKey(node), MiddleOf(node), DiagonalOf(node)});
    } else if (with_regions && node_class == NodeClass::kPlace) {
      const double clearance_m = node.place.has_value() ? node.place->clearance_m : 0.0;
      // Bins a quarter of a metre wide: a corridor's place is not that of a hall.
      const int width = static_cast<int>(clearance_m / 0.25);
      landmarks.push_back({absl::StrCat("p ", width), node.map_T_node.position, clearance_m});
    }
  }
  return landmarks;
}

bool AreAlike(const Landmark& a, const Landmark& b) {
  if (a.size_m <= 0.0 || b.size_m <= 0.0) return true;
  return a.size_m < 2.0 * b.size_m && b.size_m < 2.0 * a.size_m;
}

std::vector<KindPair> PairKinds(const std::vector<Landmark>& into,
                                const std::vector<Landmark>& other) {
  std::map<std::string, KindPair> by_kind;
  for (size_t i = 0; i < into.size(); ++i) {
    by_kind[into[i].kind].into.push_back(static_cast<int>(i));
  }
  for (size_t i = 0; i < other.size(); ++i) {
    by_kind[other[i].kind].other.push_back(static_cast<int>(i));
  }
  std::vector<KindPair> pairs;
  for (auto& [kind, pair] : by_kind) {
    if (!pair.into.empty() && !pair.other.empty()) pairs.push_back(std::move(pair));
  }
  return pairs;
}

}  // namespace dsg::merge
