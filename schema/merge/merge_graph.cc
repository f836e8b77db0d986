// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/merge_graph.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/merge/fuse.h"
#include "schema/merge/merge_edges.h"
#include "schema/model/delta_check.h"

namespace dsg::merge {
namespace {

// Revisions of the origin that agents keep.
constexpr size_t kRevisionsKept = 4;

uint32_t InstanceOf(const Node& node) {
  if (node.object.has_value()) return node.object->mesh_instance_id;
  if (node.structure.has_value()) return node.structure->mesh_instance_id;
  return 0;
}

void SetInstance(uint32_t instance, Node* node) {
  if (node->object.has_value()) node->object->mesh_instance_id = instance;
  if (node->structure.has_value()) node->structure->mesh_instance_id = instance;
}

struct ParentLink {
  int32_t child_rank = 0;
  size_t parent = 0;
  size_t child = 0;
};

void GrowOverChild(const Node& child, Node* parent) {
  if (parent->box_node.isEmpty() || IsAgentKind(child.kind)) return;
  const Box3d inner = child.BoxMap();
  const Box3d outer = parent->BoxMap();
  // Half of the store's tolerance, so that existing boxes do not change.
  constexpr double kSlack = 0.5 * kBoxToleranceM;
  if (((outer.min() - inner.min()).array() <= kSlack).all() &&
      ((inner.max() - outer.max()).array() <= kSlack).all()) {
    return;
  }
  parent->box_node.extend(TransformBox(parent->map_T_node.Inverse(), inner));
}

// Extends boxes of parents over their children, as the store requires. Nodes without an extent keep
// none.
void FitParents(const std::vector<Layer>& layers, const std::vector<Edge>& edges,
                std::vector<Node>* nodes) {
  std::unordered_map<LayerId, int32_t> rank_of;
  for (const Layer& layer : layers) rank_of[layer.id] = layer.rank;
  std::unordered_map<NodeId, size_t> index_of;
  for (size_t i = 0; i < nodes->size(); ++i) index_of[(*nodes)[i].id] = i;
  std::vector<ParentLink> links;
  for (const Edge& edge : edges) {
    if (edge.relation != relations::kContains) continue;
    const auto parent = index_of.find(edge.source);
    const auto child = index_of.find(edge.target);
    if (parent == index_of.end() || child == index_of.end()) continue;
    links.push_back({rank_of[(*nodes)[child->second].layer], parent->second, child->second});
  }
  // Parents have higher ranks than children, so a child is complete before its parent is.
  std::stable_sort(links.begin(), links.end(), [](const ParentLink& a, const ParentLink& b) {
    return a.child_rank < b.child_rank;
  });
  for (const ParentLink& link : links) GrowOverChild((*nodes)[link.child], &(*nodes)[link.parent]);
}

// Builds the merged graph, and lists its differences to the present one.
class GraphBuilder {
 public:
  GraphBuilder(const MapContent& into, const MapContent& other, const Findings& findings,
               const MergeOptions& options, MergePlan* plan)
      : into_(into),
        other_(other),
        pair_of_(findings.pair_of),
        known_(findings.known),
        tracks_(findings.tracks),
        written_(options.written),
        used_ids_(options.used_ids),
        is_copy_(into.nodes.size(), 0),
        plan_(*plan) {
    whole_.layers = into.layers;
    whole_.layers.insert(whole_.layers.end(), plan->graph.layers.begin(), plan->graph.layers.end());
    whole_.nodes = into.nodes;
    for (const Node& node : into.nodes) {
      uint64_t& largest = used_ids_[node.id.letter()];
      largest = std::max(largest, node.id.index());
      if (IsAgentKind(node.kind)) agent_names_.insert(node.name);
      if (InstanceOf(node) != 0) instances_.insert(InstanceOf(node));
    }
  }

  absl::Status Build(const SessionChanges& changes) {
    DSG_RETURN_IF_ERROR(AssignIds());
    for (size_t i = 0; i < other_.nodes.size(); ++i) TakeNode(i);
    AddEdges();
    Close(changes);
    FitParents(whole_.layers, whole_.edges, &whole_.nodes);
    MarkCopies();
    ListChanges();
    return absl::OkStatus();
  }

 private:
  absl::Status AssignIds() {
    id_of_.resize(other_.nodes.size());
    for (size_t i = 0; i < other_.nodes.size(); ++i) {
      const int pair = pair_of_[i];
      if (pair >= 0) {
        id_of_[i] = into_.nodes[static_cast<size_t>(pair)].id;
      } else {
        DSG_ASSIGN_OR_RETURN(id_of_[i], FreshId(other_.nodes[i].id));
      }
      plan_.node_ids[other_.nodes[i].id] = id_of_[i];
    }
    return absl::OkStatus();
  }

  absl::StatusOr<NodeId> FreshId(NodeId theirs) {
    const char letter = theirs.letter();
    const auto [found, is_new] = used_ids_.try_emplace(letter, 0);
    // An unused letter begins at 0, like those of robots.
    if (is_new) return NodeId(letter, found->second);
    if (found->second < NodeId::kIndexMax) return NodeId(letter, ++found->second);
    const std::string last = ToString(NodeId(letter, found->second));
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat("node ", ToString(theirs), " of map \"", plan_.other_name,
                                  "\" cannot be added: map \"", plan_.into_name, "\" has used ",
                                  last, ", and there is no id of that letter above it; merge \"",
                                  plan_.into_name, "\" into a new map, which numbers anew"),
                     {{"map", plan_.into_name}, {"id", last}});
  }

  void TakeNode(size_t i) {
    Node seen = other_.nodes[i];
    if (pair_of_[i] < 0) {
      TakeInstance(-1, &seen);
      AddNode(i, std::move(seen));
      return;
    }
    Node& known = whole_.nodes[static_cast<size_t>(pair_of_[i])];
    const std::optional<Origin>& origin = known_.origin_of[i];
    const bool is_copy = origin.has_value() && CopiedFrom(known).has_value();
    if (is_copy) {
      is_copy_[static_cast<size_t>(pair_of_[i])] = 1;
    } else {
      CountFused(known, seen);
    }
    if (Stays(i, known, is_copy)) {
      KeepInstance(known, seen);
      return;
    }
    TakeInstance(pair_of_[i], &seen);
    if (is_copy) {
      RefreshCopy(OriginNow(i), seen, &known);
      copies_.insert(static_cast<size_t>(pair_of_[i]));
    } else {
      FuseNode(plan_.into_name, OriginNow(i), origin.has_value(), seen, &known);
    }
  }

  // Whether the node stays as it is here, whatever the other map has.
  bool Stays(size_t i, const Node& known, bool is_copy) {
    if (written_.nodes.contains(other_.nodes[i].id)) return true;
    const std::optional<Origin>& origin = known_.origin_of[i];
    const bool is_news = !origin.has_value() || origin->seen_mark != known_.mark_of[i];
    // Others have changed the copy here, and their change wins.
    if (is_copy && !IsAsWritten(known, *origin)) {
      if (is_news) ++plan_.counts.kept_count;
      return true;
    }
    return !is_copy && !is_news;
  }

  // The origin to note for node `i`.
  Origin OriginNow(size_t i) const {
    Origin origin;
    origin.map = plan_.other_name;
    origin.id = other_.nodes[i].id;
    origin.seen_mark = known_.mark_of[i];
    const std::optional<Origin>& before = known_.origin_of[i];
    origin.is_copy = before.has_value() && before->is_copy;
    const bool is_track_new = tracks_.changed.contains(static_cast<int>(i));
    if (before.has_value() && before->seen_mark == origin.seen_mark && !is_track_new) {
      origin.revisions = before->revisions;
      return origin;
    }
    if (before.has_value() && IsAgentKind(other_.nodes[i].kind)) {
      origin.revisions = before->revisions;
      if (origin.revisions.size() >= kRevisionsKept) {
        origin.revisions.erase(origin.revisions.begin());
      }
    }
    if (origin.revisions.empty() || origin.revisions.back() != plan_.other_revision) {
      origin.revisions.push_back(plan_.other_revision);
    }
    return origin;
  }

  void AddNode(size_t i, Node node) {
    Origin origin = OriginNow(i);
    origin.is_copy = true;
    origin.observation_count = OwnCount(node);
    node.id = id_of_[i];
    node.revision = 0;
    const std::vector<Origin> older = OriginsOf(node);
    node.attributes.erase(kMergedFrom);
    node.attributes.erase(kMergedCounts);
    SetOrigin(std::move(origin), &node);
    // Keeps the origins in third maps.
    for (Origin each : older) {
      each.is_copy = false;
      if (each.map != plan_.into_name) SetOrigin(std::move(each), &node);
    }
    if (IsAgentKind(node.kind)) {
      if (agent_names_.contains(node.name)) absl::StrAppend(&node.name, "@", plan_.other_name);
      agent_names_.insert(node.name);
    }
    copies_.insert(whole_.nodes.size());
    whole_.nodes.push_back(std::move(node));
    ++plan_.counts.added_node_count;
  }

  // Each map numbers its mesh instances on its own.
  void TakeInstance(int pair, Node* seen) {
    const uint32_t theirs = InstanceOf(*seen);
    if (theirs == 0) return;
    uint32_t mine = pair < 0 ? 0 : InstanceOf(into_.nodes[static_cast<size_t>(pair)]);
    if (mine == 0) mine = *instances_.insert(FreeNumber(instances_)).first;
    plan_.instance_of[theirs] = mine;
    SetInstance(mine, seen);
  }

  void KeepInstance(const Node& known, const Node& seen) {
    const uint32_t theirs = InstanceOf(seen);
    if (theirs != 0 && InstanceOf(known) != 0) plan_.instance_of[theirs] = InstanceOf(known);
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
    const std::vector<EdgeKey> replaced = ReplacedEdges(into_, other_, id_of_, is_copy_);
    plan_.graph.edge_removals = replaced;
    plan_.graph.edges = JoinEdges(into_, other_, pair_of_, id_of_, replaced, written_.edges);
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
      // A guess among similar things; half of them are right in tests.
      same.weight = 0.5;
      plan_.moved.emplace_back(same.target, same.source);
      plan_.graph.edges.push_back(std::move(same));
    }
    plan_.counts.moved_count = static_cast<int64_t>(plan_.moved.size());
  }

  // Runs last, when the nodes do not change any more.
  void MarkCopies() {
    for (const size_t i : copies_) {
      Node& node = whole_.nodes[i];
      std::optional<Origin> origin = CopiedFrom(node);
      if (!origin.has_value()) continue;
      origin->written_mark = MarkOf(node);
      SetOrigin(*std::move(origin), &node);
    }
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
  const KnownPairs& known_;
  const TrackHistory& tracks_;
  const Written& written_;
  UsedIds used_ids_;
  /// By node of `into`: it is a copy from the other map.
  std::vector<char> is_copy_;
  MergePlan& plan_;
  GraphDelta whole_;
  std::vector<NodeId> id_of_;
  std::set<std::string> agent_names_;
  std::set<uint32_t> instances_;
  /// Indices in `whole_` of copies that this plan writes.
  std::set<size_t> copies_;
  double squared_sum_ = 0.0;
};

}  // namespace

absl::Status BuildGraph(const MapContent& into, const MapContent& other, const Findings& findings,
                        const MergeOptions& options, MergePlan* plan) {
  return GraphBuilder(into, other, findings, options, plan).Build(findings.changes);
}

}  // namespace dsg::merge
