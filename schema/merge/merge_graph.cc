// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge_graph.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/merge/fit_boxes.h"
#include "schema/merge/fuse.h"
#include "schema/merge/merge_edges.h"
#include "schema/merge/origins.h"
#include "schema/merge/transform_node.h"
#include "schema/model/delta_check.h"

namespace dsg::merge {
namespace {

template <typename Key>
Key FreshKey(const std::set<Key>& used) {
  return used.empty() ? 1 : *used.rbegin() + 1;
}

uint32_t InstanceOf(const Node& node) {
  if (node.object.has_value()) return node.object->mesh_instance_id;
  if (node.structure.has_value()) return node.structure->mesh_instance_id;
  return 0;
}

void SetInstance(uint32_t instance, Node* node) {
  if (node->object.has_value()) node->object->mesh_instance_id = instance;
  if (node->structure.has_value()) node->structure->mesh_instance_id = instance;
}

// Puts together what the map will hold, and at the end lists what differs from what it holds.
class GraphBuilder {
 public:
  GraphBuilder(const MapContent& into, const MapContent& other, const std::vector<int>& pair_of,
               const UsedIds& used_ids, MergePlan* plan)
      : into_(into), other_(other), pair_of_(pair_of), used_ids_(used_ids), plan_(*plan) {
    whole_.layers = into.layers;
    whole_.layers.insert(whole_.layers.end(), plan->graph.layers.begin(), plan->graph.layers.end());
    whole_.nodes = into.nodes;
    for (const Node& node : into.nodes) {
      uint64_t& largest = used_ids_[node.id.letter()];
      largest = std::max(largest, node.id.index());
      if (IsAgentKind(node.kind)) agent_names_.insert(node.name);
      instance_last_ = std::max(instance_last_, InstanceOf(node));
    }
  }

  void Build(const SessionChanges& changes) {
    AssignIds();
    for (size_t i = 0; i < other_.nodes.size(); ++i) TakeNode(i);
    AddEdges();
    Close(changes);
    FitParents(whole_.layers, whole_.edges, &whole_.nodes);
    ListChanges();
  }

 private:
  void AssignIds() {
    id_of_.resize(other_.nodes.size());
    for (size_t i = 0; i < other_.nodes.size(); ++i) {
      const int pair = pair_of_[i];
      const char letter = other_.nodes[i].id.letter();
      id_of_[i] = pair >= 0 ? into_.nodes[static_cast<size_t>(pair)].id : FreshId(letter);
      plan_.node_ids[other_.nodes[i].id] = id_of_[i];
    }
  }

  NodeId FreshId(char letter) {
    const auto [found, is_new] = used_ids_.try_emplace(letter, 0);
    // A letter that nobody has used may begin at 0, as those of the robots do.
    if (is_new) return NodeId(letter, found->second);
    return NodeId(letter, ++found->second);
  }

  void TakeNode(size_t i) {
    Node seen = other_.nodes[i];
    const int pair = pair_of_[i];
    TakeInstance(pair, &seen);
    if (pair < 0) {
      AddNode(i, std::move(seen));
      return;
    }
    Node& known = whole_.nodes[static_cast<size_t>(pair)];
    const auto copy = CopiedFrom(known);
    if (copy.has_value() && copy->map == plan_.other_name && copy->id == seen.id) {
      RefreshCopy(plan_.other_name, seen.id, seen, &known);
      return;
    }
    CountFused(known, seen);
    FuseNode(plan_.other_name, seen.id, seen, &known);
  }

  void AddNode(size_t i, Node node) {
    const NodeId origin = node.id;
    node.id = id_of_[i];
    node.revision = 0;
    const std::vector<Origin> older = OriginsOf(node);
    node.attributes.erase(kMergedFrom);
    node.attributes.erase(kMergedCounts);
    SetOrigin({plan_.other_name, origin, node.observation_count, true}, &node);
    // What the other map took from third ones is known to have come from there.
    for (const Origin& each : older) {
      if (each.map != plan_.into_name) {
        SetOrigin({each.map, each.id, each.observation_count, false}, &node);
      }
    }
    if (IsAgentKind(node.kind)) {
      if (agent_names_.contains(node.name)) absl::StrAppend(&node.name, "@", plan_.other_name);
      agent_names_.insert(node.name);
    }
    whole_.nodes.push_back(std::move(node));
    ++plan_.counts.added_node_count;
  }

  // Mesh instances are numbered by each map for itself.
  void TakeInstance(int pair, Node* seen) {
    const uint32_t theirs = InstanceOf(*seen);
    if (theirs == 0) return;
    uint32_t mine = pair < 0 ? 0 : InstanceOf(into_.nodes[static_cast<size_t>(pair)]);
    if (mine == 0) mine = ++instance_last_;
    plan_.instance_of[theirs] = mine;
    SetInstance(mine, seen);
  }

  void CountFused(const Node& known, const Node& seen) {
    if (seen.kind == kinds::kObject) {
      ++plan_.counts.fused_object_count;
      squared_sum_ +=
          (known.map_T_node * CenterOf(known) - seen.map_T_node * CenterOf(seen)).squaredNorm();
      plan_.residual_m =
          std::sqrt(squared_sum_ / static_cast<double>(plan_.counts.fused_object_count));
    } else if (seen.kind == kinds::kPlace) {
      ++plan_.counts.fused_place_count;
    } else if (seen.kind == kinds::kRoom) {
      ++plan_.counts.fused_room_count;
    } else if (seen.kind == kinds::kStructure) {
      ++plan_.counts.fused_structure_count;
    }
  }

  static Eigen::Vector3d CenterOf(const Node& node) {
    return node.box_node.isEmpty() ? Eigen::Vector3d::Zero().eval()
                                   : Eigen::Vector3d(node.box_node.center());
  }

  void AddEdges() {
    const std::vector<EdgeKey> replaced = ReplacedEdges(into_, other_, id_of_);
    plan_.graph.edge_removals = replaced;
    plan_.graph.edges = JoinEdges(into_, other_, pair_of_, id_of_, replaced);
    for (Edge& bridge : BridgePlaces(into_, other_, pair_of_, id_of_)) {
      plan_.graph.edges.push_back(std::move(bridge));
    }
    for (const Edge& edge : into_.edges) {
      const bool stays = !std::binary_search(replaced.begin(), replaced.end(), edge.key());
      if (stays) whole_.edges.push_back(edge);
    }
    whole_.edges.insert(whole_.edges.end(), plan_.graph.edges.begin(), plan_.graph.edges.end());
  }

  void Close(const SessionChanges& changes) {
    for (const Gone& gone : changes.gone) {
      Node& node = whole_.nodes[static_cast<size_t>(gone.into)];
      node.valid.to_ns = gone.at_ns;
      plan_.gone.push_back(node.id);
    }
    plan_.counts.gone_count = static_cast<int64_t>(plan_.gone.size());
    for (const auto& [before, after] : changes.moved) {
      Edge same;
      same.source = id_of_[static_cast<size_t>(after)];
      same.relation = relations::kSameAs;
      same.target = into_.nodes[static_cast<size_t>(before)].id;
      // A guess among things that look alike; in tests half of them are right.
      same.weight = 0.5;
      plan_.moved.emplace_back(same.target, same.source);
      plan_.graph.edges.push_back(std::move(same));
    }
    plan_.counts.moved_count = static_cast<int64_t>(plan_.moved.size());
  }

  void ListChanges() {
    for (size_t i = 0; i < whole_.nodes.size(); ++i) {
      Node& node = whole_.nodes[i];
      if (i < into_.nodes.size() && EncodeNodePayload(node) == EncodeNodePayload(into_.nodes[i])) {
        continue;
      }
      node.revision = 0;
      plan_.graph.nodes.push_back(std::move(node));
    }
    for (Edge& edge : plan_.graph.edges) edge.revision = 0;
    Coalesce(&plan_.graph);
  }

  const MapContent& into_;
  const MapContent& other_;
  const std::vector<int>& pair_of_;
  UsedIds used_ids_;
  MergePlan& plan_;
  GraphDelta whole_;
  std::vector<NodeId> id_of_;
  std::set<std::string> agent_names_;
  uint32_t instance_last_ = 0;
  double squared_sum_ = 0.0;
};

}  // namespace

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
    if (layer_ids.contains(layer.id)) layer.id = FreshKey(layer_ids);
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
    if (class_ids.contains(label.id)) label.id = FreshKey(class_ids);
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

void BuildGraph(const MapContent& into, const MapContent& other, const std::vector<int>& pair_of,
                const SessionChanges& changes, const UsedIds& used_ids, MergePlan* plan) {
  GraphBuilder(into, other, pair_of, used_ids, plan).Build(changes);
}

}  // namespace dsg::merge
