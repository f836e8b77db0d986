// SPDX-License-Identifier: Apache-2.0
#include "query/view/view_parts.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// What a node's attributes take beside the node: entries of the map, and texts too long for it.
int64_t BytesOf(const std::shared_ptr<const Attributes>& attributes) {
  if (attributes == nullptr) return 0;
  constexpr size_t kShortText = 15;
  const auto text_bytes = [](const std::string& text) {
    return text.size() > kShortText ? text.size() + 1 : 0;
  };
  size_t bytes = 16 + sizeof(Attributes);
  for (const auto& [name, value] : *attributes) {
    bytes += 32 + sizeof(Attributes::value_type) + text_bytes(name);
    if (const auto* text = std::get_if<std::string>(&value)) bytes += text_bytes(*text);
  }
  return static_cast<int64_t>(bytes);
}

}  // namespace

ViewParts::ViewParts(std::shared_ptr<SymbolTable> symbols)
    : symbols_(std::move(symbols)),
      contains_(symbols_->Intern(relations::kContains)),
      human_(symbols_->Intern(kinds::kHuman)),
      robot_(symbols_->Intern(kinds::kRobot)) {}

ViewNode ViewParts::ToView(const Node& node) {
  ViewNode view = WithoutAttributes(node);
  if (!node.attributes.empty()) {
    view.attributes = std::make_shared<const Attributes>(node.attributes);
  }
  return view;
}

ViewNode ViewParts::ToView(Node&& node) {
  ViewNode view = WithoutAttributes(node);
  if (!node.attributes.empty()) {
    view.attributes = std::make_shared<const Attributes>(std::move(node.attributes));
  }
  return view;
}

ViewNode ViewParts::WithoutAttributes(const Node& node) {
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
  return view;
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
  attribute_bytes_ += change * BytesOf(node.attributes);
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

}  // namespace dsg::query
