// SPDX-License-Identifier: Apache-2.0
#include "query/view/indexed_view.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <unordered_set>

#include "query/view/stoppable_sort.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/model/known_names.h"

namespace dsg::query {
namespace {

// What a node's attributes take beside the node: the array with its counts, and texts that do not
// fit into it.
int64_t AttributeBytesOf(const ViewNode& node) {
  if (node.attribute_count == 0) return 0;
  constexpr size_t kArrayHead = 24;
  constexpr size_t kShortText = 15;
  size_t bytes = kArrayHead + node.attribute_count * sizeof(ViewAttribute);
  for (const ViewAttribute& attribute : node.attributes()) {
    const auto* const text = std::get_if<std::string>(&attribute.value);
    if (text != nullptr && text->size() > kShortText) bytes += text->size() + 1;
  }
  return static_cast<int64_t>(bytes);
}

}  // namespace

ViewParts::ViewParts(std::shared_ptr<SymbolTable> symbols)
    : symbols_(std::move(symbols)), contains_(symbols_->Intern(relations::kContains)) {
  for (const kinds::Kind& kind : kinds::kAll) {
    if (kind.is_agent) agents_.push_back(symbols_->Intern(kind.name));
  }
}

ViewNode ViewParts::ToView(const Node& node) {
  ViewNode view;
  view.id = node.id;
  view.layer = node.layer;
  view.kind = symbols_->Intern(node.kind);
  view.class_name = symbols_->Intern(node.class_name);
  view.class_id = node.class_id;
  view.name = symbols_->Intern(node.name);
  if (node.object.has_value()) view.color = node.object->color;
  view.map_T_node = node.map_T_node;
  view.box_node = node.box_node;
  view.valid = node.valid;
  if (node.place.has_value()) view.clearance_m = node.place->clearance_m;
  SetAttributes(node.attributes, &view);
  return view;
}

// What a file said besides is long, and of no use to a question.
void ViewParts::SetAttributes(const Attributes& attributes, ViewNode* view) {
  view->attribute_count = static_cast<uint32_t>(std::ranges::count_if(
      attributes, [](const auto& entry) { return !attributes::IsFileRest(entry.first); }));
  if (view->attribute_count == 0) return;
  auto array = std::make_shared<ViewAttribute[]>(view->attribute_count);
  size_t filled = 0;
  for (const auto& [name, value] : attributes) {
    if (!attributes::IsFileRest(name)) array[filled++] = {symbols_->Intern(name), value};
  }
  view->attribute_array = std::move(array);
}

ViewEdge ViewParts::ToView(const Edge& edge) {
  return {edge.source, edge.target, symbols_->Intern(edge.relation), edge.weight, edge.valid};
}

absl::Status ViewParts::FillNodes(std::vector<ViewNode> nodes, const StopCheck& stop) {
  std::vector<uint32_t> order(nodes.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto less = [&](uint32_t a, uint32_t b) { return nodes[a].id < nodes[b].id; };
  DSG_RETURN_IF_ERROR(SortStoppably(less, stop, &order));
  StopCounter counter(stop);
  CowTree<NodeTraits>::Builder builder;
  std::vector<SpaceEntry> space;
  std::vector<std::pair<Symbol, NodeId>> names;
  space.reserve(nodes.size());
  NodeId before;
  for (const uint32_t i : order) {
    ViewNode& node = nodes[i];
    DSG_RETURN_IF_ERROR(counter.Check());
    if (node.id == before) continue;
    before = node.id;
    space.push_back(MakeSpaceEntry(node, IsAgent(node)));
    if (node.name != 0) names.emplace_back(node.name, node.id);
    CountNode(node, 1);
    builder.Append(std::move(node));
  }
  nodes_ = builder.Finish();
  const auto is_before = [](const SpaceEntry& a, const SpaceEntry& b) { return a.key < b.key; };
  DSG_RETURN_IF_ERROR(SortStoppably(is_before, stop, &space));
  SpaceTree::Builder space_builder;
  for (const SpaceEntry& entry : space) space_builder.Append(entry);
  space_ = space_builder.Finish();
  DSG_RETURN_IF_ERROR(SortStoppably(std::less<>(), stop, &names));
  CowTree<NameTraits>::Builder name_builder;
  for (const auto& entry : names) name_builder.Append(entry);
  names_ = name_builder.Finish();
  return absl::OkStatus();
}

absl::Status ViewParts::FillEdges(std::vector<ViewEdge> edges, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(edges_, EdgeIndex::Make(std::move(edges), stop));
  return absl::OkStatus();
}

ViewParts ViewParts::Fork() const {
  ViewParts fork = *this;
  fork.nodes_ = nodes_.Fork();
  fork.names_ = names_.Fork();
  fork.space_ = space_.Fork();
  fork.edges_ = edges_.Fork();
  return fork;
}

void ViewParts::PutNode(ViewNode node) {
  SpaceEntry entry = MakeSpaceEntry(node, IsAgent(node));
  if (const ViewNode* old = nodes_.Find(node.id)) {
    const SpaceKey old_key = MakeSpaceEntry(*old, IsAgent(*old)).key;
    if (old_key != entry.key) space_.Erase(old_key);
    if (old->name != 0 && old->name != node.name) names_.Erase({old->name, old->id});
    CountNode(*old, -1);
  }
  space_.Put(entry);
  if (node.name != 0 && names_.Find({node.name, node.id}) == nullptr) {
    names_.Put({node.name, node.id});
  }
  CountNode(node, 1);
  nodes_.Put(std::move(node));
}

bool ViewParts::EraseNode(NodeId id) {
  const ViewNode* old = nodes_.Find(id);
  if (old == nullptr) return false;
  space_.Erase(MakeSpaceEntry(*old, IsAgent(*old)).key);
  if (old->name != 0) names_.Erase({old->name, id});
  CountNode(*old, -1);
  nodes_.Erase(id);
  return true;
}

void ViewParts::CountNode(const ViewNode& node, int64_t change) {
  const auto count = class_counts_.try_emplace({node.layer, node.class_name}, 0).first;
  count->second += change;
  if (count->second == 0) class_counts_.erase(count);
  attribute_bytes_ += change * AttributeBytesOf(node);
}

size_t ViewParts::memory_bytes() const {
  constexpr size_t kClassBytes = 64;
  return nodes_.memory_bytes() + names_.memory_bytes() + space_.memory_bytes() +
         edges_.memory_bytes() + class_counts_.size() * kClassBytes +
         static_cast<size_t>(attribute_bytes_);
}

size_t ViewParts::fresh_bytes() const {
  return nodes_.fresh_bytes() + names_.fresh_bytes() + space_.fresh_bytes() + edges_.fresh_bytes();
}

size_t IndexedView::memory_bytes() const { return parts_.memory_bytes() + places_->memory_bytes(); }

void IndexedView::ForEachNode(NodeId after,
                              const std::function<bool(const ViewNode&)>& visit) const {
  parts_.nodes().Scan(after, [&](const ViewNode& node) { return node.id == after || visit(node); });
}

std::vector<NodeId> IndexedView::NodesNamed(std::string_view name) const {
  std::vector<NodeId> ids;
  const auto symbol = symbols().Find(name);
  if (!name.empty() && symbol.has_value()) AppendNodesNamed(*symbol, &ids);
  return ids;
}

std::vector<NodeId> IndexedView::NodesNamedIgnoringCase(std::string_view name) const {
  std::vector<NodeId> ids;
  if (name.empty()) return ids;
  for (const Symbol symbol : symbols().FindIgnoringCase(name)) AppendNodesNamed(symbol, &ids);
  std::sort(ids.begin(), ids.end());
  return ids;
}

void IndexedView::AppendNodesNamed(Symbol name, std::vector<NodeId>* ids) const {
  parts_.names().Scan({name, NodeId()}, [&](const std::pair<Symbol, NodeId>& entry) {
    if (entry.first != name) return false;
    ids->push_back(entry.second);
    return true;
  });
}

void IndexedView::ForEachInRange(const SpaceRange& range,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  parts_.space().Scan(range.first, [&](const SpaceEntry& entry) {
    return entry.key <= range.second && visit(*FindNode(entry.key.id));
  });
}

void IndexedView::ForEachOfClass(LayerId layer, Symbol class_name,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  ForEachInRange(RangeOf(layer, class_name), visit);
}

void IndexedView::ForEachInLayer(LayerId layer,
                                 const std::function<bool(const ViewNode&)>& visit) const {
  ForEachInRange(RangeOf(layer), visit);
}

std::vector<std::pair<Symbol, int64_t>> IndexedView::ClassesOf(LayerId layer) const {
  std::vector<std::pair<Symbol, int64_t>> classes;
  const auto& counts = parts_.class_counts();
  for (auto it = counts.lower_bound({layer, 0}); it != counts.end() && it->first.first == layer;
       ++it) {
    classes.emplace_back(it->first.second, it->second);
  }
  return classes;
}

void IndexedView::ForEachEdgeFrom(NodeId source,
                                  const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachFrom(source, visit);
}

void IndexedView::ForEachEdgeFrom(NodeId source, Symbol relation,
                                  const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachFrom(source, relation, visit);
}

void IndexedView::ForEachEdgeTo(NodeId target,
                                const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachTo(target, visit);
}

void IndexedView::ForEachEdgeTo(NodeId target, Symbol relation,
                                const std::function<bool(const ViewEdge&)>& visit) const {
  parts_.edges().ForEachTo(target, relation, visit);
}

NodeId IndexedView::Parent(NodeId id) const {
  return parts_.edges().FirstSource(id, parts_.contains());
}

std::vector<NodeId> IndexedView::Ancestors(NodeId id) const {
  std::vector<NodeId> ancestors;
  // Ranks grow from child to parent, so the chain ends.
  for (NodeId at = Parent(id); !at.empty(); at = Parent(at)) ancestors.push_back(at);
  return ancestors;
}

void IndexedView::ForEachDescendant(NodeId id,
                                    const std::function<bool(const ViewNode&)>& visit) const {
  std::vector<NodeId> level = {id};
  // A node may have several parents, also at different heights.
  std::unordered_set<NodeId> seen = {id};
  while (!level.empty()) {
    std::vector<NodeId> children;
    for (const NodeId parent : level) {
      const size_t first = children.size();
      parts_.edges().AppendTargets(parent, parts_.contains(), &children);
      size_t kept = first;
      for (size_t i = first; i < children.size(); ++i) {
        if (!seen.insert(children[i]).second) continue;
        children[kept++] = children[i];
        if (!visit(*FindNode(children[i]))) return;
      }
      children.resize(kept);
    }
    level = std::move(children);
  }
}

std::vector<SpaceRange> IndexedView::RangesOf(const SpaceFilter& filter) const {
  std::vector<SpaceRange> ranges;
  if (!filter.layer.has_value() && !filter.class_name.has_value()) return {RangeOfAll()};
  if (!filter.class_name.has_value()) return {RangeOf(*filter.layer)};
  if (filter.layer.has_value()) return {RangeOf(*filter.layer, *filter.class_name)};
  for (const auto& [key, unused] : parts_.class_counts()) {
    if (key.second == *filter.class_name) ranges.push_back(RangeOf(key.first, key.second));
  }
  return ranges;
}

void IndexedView::ForEachNearest(
    const Eigen::Vector3d& point_map, const SpaceFilter& filter, double distance_m_max,
    const std::function<bool(const ViewNode&, double distance_m)>& visit) const {
  VisitNearest(
      parts_.space(), RangesOf(filter), point_map, distance_m_max,
      [this](NodeId id) { return FindNode(id); }, visit);
}

void IndexedView::ForEachTouching(const Box3d& box_map, const SpaceFilter& filter,
                                  const std::function<bool(const ViewNode&)>& visit) const {
  VisitCandidates(parts_.space(), RangesOf(filter), box_map, [&](NodeId id) {
    const ViewNode* node = FindNode(id);
    return !node->BoxMap().intersects(box_map) || visit(*node);
  });
}

absl::StatusOr<std::shared_ptr<const PlaceGraph>> IndexedView::Places(const StopCheck& stop) const {
  return places_->graph.Get(stop, [&] { return PlaceGraph::Build(*this, stop); });
}

namespace {

// Entities read at once: no more of them are in memory than these and those of the view.
constexpr size_t kBatchEntities = 256;

absl::Status CheckStop(const StopCheck& stop) { return stop ? stop() : absl::OkStatus(); }

// Reads what was touched, as it is at a snapshot, into a fork of an older or newer view.
class Update {
 public:
  Update(const IndexedView& from, const Snapshot& snapshot, const StopCheck& stop)
      : from_(from), parts_(from.parts().Fork()), snapshot_(snapshot), stop_(stop) {}

  absl::Status Apply(const Touched& touched) {
    if (touched.layers_or_labels) {
      DSG_ASSIGN_OR_RETURN(auto layers, snapshot_.Layers());
      parts_.SetLayers(std::move(layers));
    }
    for (const auto& ids : Batches(touched.nodes)) {
      DSG_ASSIGN_OR_RETURN(auto nodes, snapshot_.FindNodes(ids, stop_));
      for (size_t i = 0; i < ids.size(); ++i) UpdateNode(ids[i], std::move(nodes[i]));
    }
    for (const auto& keys : Batches(touched.edges)) {
      DSG_ASSIGN_OR_RETURN(const auto edges, snapshot_.FindEdges(keys, stop_));
      for (size_t i = 0; i < keys.size(); ++i) UpdateEdge(keys[i], edges[i]);
    }
    return absl::OkStatus();
  }

  std::shared_ptr<const IndexedView> Finish() {
    return std::make_shared<IndexedView>(
        snapshot_.revision(), std::move(parts_),
        places_differ_ ? std::make_shared<SharedPlaces>() : from_.shared_places());
  }

 private:
  template <typename Key>
  static std::vector<std::vector<Key>> Batches(const std::vector<Key>& keys) {
    std::vector<std::vector<Key>> batches;
    for (size_t first = 0; first < keys.size(); first += kBatchEntities) {
      const size_t last = std::min(first + kBatchEntities, keys.size());
      batches.emplace_back(keys.begin() + static_cast<std::ptrdiff_t>(first),
                           keys.begin() + static_cast<std::ptrdiff_t>(last));
    }
    return batches;
  }

  void UpdateNode(NodeId id, std::optional<Node> node) {
    const ViewNode* before = from_.FindNode(id);
    const LayerId layer_before = before != nullptr ? before->layer : 0;
    const LayerId layer_after = node.has_value() ? node->layer : 0;
    places_differ_ = places_differ_ || layer_before == layers::kPlaces ||
                     layer_after == layers::kPlaces ||
                     (before != nullptr && node.has_value() && layer_before != layer_after);
    if (node.has_value()) {
      parts_.PutNode(parts_.ToView(*node));
    } else {
      parts_.EraseNode(id);
    }
  }

  // What a place is linked to and which room it is in. Only objects are below places, so what
  // contains them is of no concern.
  bool ConcernsPlaces(const EdgeKey& key) const {
    if (key.relation == relations::kTraversable) return true;
    if (key.relation != relations::kContains) return false;
    const ViewNode* before = from_.FindNode(key.target);
    const ViewNode* target = before != nullptr ? before : parts_.nodes().Find(key.target);
    return target == nullptr || target->layer != layers::kObjects;
  }

  void UpdateEdge(const EdgeKey& key, const std::optional<Edge>& edge) {
    places_differ_ = places_differ_ || ConcernsPlaces(key);
    if (edge.has_value()) {
      parts_.edges().Put(parts_.ToView(*edge));
    } else {
      parts_.edges().Erase(key.source, parts_.symbols()->Intern(key.relation), key.target);
    }
  }

  const IndexedView& from_;
  ViewParts parts_;
  const Snapshot& snapshot_;
  const StopCheck& stop_;
  bool places_differ_ = false;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const IndexedView>> IndexedView::Load(
    const Snapshot& snapshot, std::shared_ptr<SymbolTable> symbols, const StopCheck& stop) {
  ViewParts parts(std::move(symbols));
  DSG_ASSIGN_OR_RETURN(auto layers, snapshot.Layers());
  parts.SetLayers(std::move(layers));
  DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot.Stats());
  std::vector<ViewNode> nodes;
  nodes.reserve(static_cast<size_t>(stats.at.node_count));
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllNodes(stop, [&](const Node& node) { nodes.push_back(parts.ToView(node)); }));
  DSG_RETURN_IF_ERROR(parts.FillNodes(std::move(nodes), stop));
  std::vector<ViewEdge> edges;
  edges.reserve(static_cast<size_t>(stats.at.edge_count));
  DSG_RETURN_IF_ERROR(
      snapshot.ReadAllEdges(stop, [&](const Edge& edge) { edges.push_back(parts.ToView(edge)); }));
  DSG_RETURN_IF_ERROR(CheckStop(stop));
  DSG_RETURN_IF_ERROR(parts.FillEdges(std::move(edges), stop));
  return std::make_shared<const IndexedView>(snapshot.revision(), std::move(parts),
                                             std::make_shared<SharedPlaces>());
}

absl::StatusOr<std::shared_ptr<const IndexedView>> IndexedView::Derive(const IndexedView& from,
                                                                       const Touched& touched,
                                                                       const Snapshot& snapshot,
                                                                       const StopCheck& stop) {
  Update update(from, snapshot, stop);
  DSG_RETURN_IF_ERROR(update.Apply(touched));
  return update.Finish();
}

}  // namespace dsg::query
