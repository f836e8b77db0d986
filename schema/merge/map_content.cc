// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/map_content.h"

#include <algorithm>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

void Widen(TimeNs first_ns, TimeNs last_ns, std::optional<Interval>* observed) {
  if (!observed->has_value()) *observed = Interval{first_ns, last_ns + 1};
  (*observed)->from_ns = std::min((*observed)->from_ns, first_ns);
  (*observed)->to_ns = std::max((*observed)->to_ns, last_ns + 1);
}

// A node that a concurrent commit replaces may be shown twice.
template <typename T, typename KeyOf>
void SortUnique(std::vector<T>* items, KeyOf key_of) {
  std::sort(items->begin(), items->end(),
            [&](const T& a, const T& b) { return key_of(a) < key_of(b); });
  items->erase(std::unique(items->begin(), items->end(),
                           [&](const T& a, const T& b) { return key_of(a) == key_of(b); }),
               items->end());
}

}  // namespace

Eigen::Vector3d MiddleOf(const Node& node) {
  return node.box_node.isEmpty() ? node.map_T_node.position
                                 : Eigen::Vector3d(node.map_T_node * node.box_node.center());
}

double ClearanceOf(const Node& node) {
  return node.place.has_value() ? node.place->clearance_m : 0.0;
}

std::string ClassKey(const Node& node) {
  if (node.class_name == "unknown" || node.class_name == "undefined") return "";
  if (!node.class_name.empty()) return node.class_name;
  return node.class_id > 0 ? absl::StrCat("#", node.class_id) : "";
}

void MapContent::Index() {
  index_of.clear();
  index_of.reserve(nodes.size());
  for (size_t i = 0; i < nodes.size(); ++i) index_of[nodes[i].id] = static_cast<int>(i);
  rank_of.clear();
  for (const Layer& layer : layers) rank_of[layer.id] = layer.rank;
  parent.assign(nodes.size(), -1);
  // Edges ascend by source, so the first parent seen has the lowest id.
  for (const Edge& edge : edges) {
    if (edge.relation != relations::kContains) continue;
    const int child = IndexOf(edge.target);
    if (child >= 0 && parent[static_cast<size_t>(child)] < 0) {
      parent[static_cast<size_t>(child)] = IndexOf(edge.source);
    }
  }
  observed.reset();
  for (const Node& node : nodes) {
    if (node.first_observed_ns.has_value() && node.last_observed_ns.has_value() &&
        *node.last_observed_ns < kTimeMax) {
      Widen(*node.first_observed_ns, *node.last_observed_ns, &observed);
    }
  }
  for (const TrackInfo& track : tracks) {
    if (track.pose_count > 0) Widen(track.first_ns, track.last_ns, &observed);
  }
}

int MapContent::IndexOf(NodeId id) const {
  const auto found = index_of.find(id);
  return found == index_of.end() ? -1 : found->second;
}

NodeClass MapContent::ClassOf(int index) const {
  const Node& node = nodes[static_cast<size_t>(index)];
  if (IsAgentKind(node.kind)) return NodeClass::kAgent;
  if (node.kind == kinds::kPlace) return NodeClass::kPlace;
  if (node.kind == kinds::kStructure) return NodeClass::kStructure;
  if (node.kind == kinds::kObject) return NodeClass::kObject;
  const auto rank = rank_of.find(node.layer);
  const bool is_low = rank != rank_of.end() && rank->second < 300;
  return is_low && !node.region.has_value() ? NodeClass::kObject : NodeClass::kRegion;
}

std::vector<int> MapContent::OfClass(NodeClass node_class) const {
  std::vector<int> found;
  for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
    if (ClassOf(i) == node_class) found.push_back(i);
  }
  return found;
}

absl::StatusOr<MapContent> ReadContent(const Snapshot& snapshot, const StopCheck& stop) {
  MapContent content;
  content.spec = snapshot.spec();
  content.revision = snapshot.revision();
  DSG_ASSIGN_OR_RETURN(content.layers, snapshot.Layers());
  DSG_ASSIGN_OR_RETURN(content.labels, snapshot.Labels());
  DSG_ASSIGN_OR_RETURN(content.tracks, snapshot.Tracks(stop));
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllNodes(stop, [&](const Node& node) { content.nodes.push_back(node); }));
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllEdges(stop, [&](const Edge& edge) { content.edges.push_back(edge); }));
  SortUnique(&content.nodes, [](const Node& node) { return node.id; });
  SortUnique(&content.edges, [](const Edge& edge) { return edge.key(); });
  content.Index();
  return content;
}

absl::StatusOr<Vocabulary> JoinVocabularies(const MapContent& into, const MapContent& other) {
  Vocabulary vocabulary;
  std::map<std::string, Layer> layer_by_name;
  std::set<LayerId> layer_ids;
  for (const Layer& layer : into.layers) {
    layer_by_name[layer.name] = layer;
    layer_ids.insert(layer.id);
  }
  for (Layer layer : other.layers) {
    const auto known = layer_by_name.find(layer.name);
    if (known != layer_by_name.end() && known->second.rank != layer.rank) {
      return MakeError(
          Reason::kFramesIncompatible,
          absl::StrCat("layer \"", layer.name, "\" has rank ", known->second.rank, " in map \"",
                       into.spec.name, "\" and ", layer.rank, " in \"", other.spec.name,
                       "\"; maps are merged only when their layers mean the same"),
          {{"layer", layer.name}});
    }
    LayerId& mine = vocabulary.layer_of[layer.id];
    if (known != layer_by_name.end()) {
      mine = known->second.id;
      continue;
    }
    if (layer_ids.contains(layer.id)) layer.id = FreeNumber(layer_ids);
    layer_ids.insert(layer.id);
    mine = layer.id;
    vocabulary.new_layers.push_back(layer);
  }
  std::map<std::string, int32_t> class_by_name;
  std::set<int32_t> class_ids;
  for (const SemanticLabel& label : into.labels) {
    class_by_name.try_emplace(label.name, label.id);
    class_ids.insert(label.id);
  }
  for (SemanticLabel label : other.labels) {
    const auto known = class_by_name.find(label.name);
    if (known != class_by_name.end()) {
      vocabulary.class_of[label.id] = known->second;
      continue;
    }
    const int32_t theirs = label.id;
    if (class_ids.contains(label.id)) label.id = FreeNumber(class_ids);
    class_ids.insert(label.id);
    vocabulary.class_of[theirs] = label.id;
    vocabulary.new_labels.push_back(label);
  }
  return vocabulary;
}

void Adopt(const Pose3d& map_T_other, const Vocabulary& vocabulary, MapContent* other) {
  for (Node& node : other->nodes) {
    TransformNode(map_T_other, &node);
    node.layer = vocabulary.layer_of.at(node.layer);
    const auto mine = vocabulary.class_of.find(node.class_id);
    if (mine != vocabulary.class_of.end()) node.class_id = mine->second;
  }
  for (Layer& layer : other->layers) layer.id = vocabulary.layer_of.at(layer.id);
  other->Index();
}

}  // namespace dsg::merge
