// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/patch.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/field_mask_util.h>

#include <map>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"

namespace dsg {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

bool IsComponent(const FieldDescriptor& field) {
  return field.message_type() != nullptr && !field.is_repeated() &&
         absl::EndsWith(field.message_type()->name(), "Component");
}

// So that merging `from` into `to` replaces each field that it sets, but for maps and components,
// which it adds to.
void ClearWhatIsSet(const Message& from, Message* to) {
  std::vector<const FieldDescriptor*> fields;
  from.GetReflection()->ListFields(from, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->is_map()) continue;
    if (IsComponent(*field) && to->GetReflection()->HasField(*to, field)) {
      ClearWhatIsSet(from.GetReflection()->GetMessage(from, field),
                     to->GetReflection()->MutableMessage(to, field));
    } else {
      to->GetReflection()->ClearField(to, field);
    }
  }
}

void Merge(const Message& fields, const std::vector<std::string>& mask, Message* to) {
  if (mask.empty()) {
    ClearWhatIsSet(fields, to);
    to->MergeFrom(fields);
    return;
  }
  google::protobuf::FieldMask paths;
  for (const std::string& path : mask) paths.add_paths(path);
  google::protobuf::util::FieldMaskUtil::MergeOptions options;
  options.set_replace_message_fields(true);
  options.set_replace_repeated_fields(true);
  google::protobuf::util::FieldMaskUtil::MergeMessageTo(fields, paths, options, to);
}

absl::Status NotAPatch(std::string_view what) {
  return MakeError(Reason::kDeltaInvalid,
                   absl::StrCat("the patch of ", std::string(what), " cannot be read"),
                   {{"object", std::string(what)}});
}

absl::StatusOr<Node> Patched(const NodePatch& patch, const Node* stored, const LayerTable& layers) {
  v1::Node fields;
  if (!fields.ParseFromString(patch.fields)) return NotAPatch("node " + ToString(patch.id));
  v1::Node node;
  if (stored != nullptr) ToProto(*stored, layers, &node);
  Merge(fields, patch.mask, &node);
  node.set_id(ToString(patch.id));
  return FromProto(node, layers);
}

absl::StatusOr<Edge> Patched(const EdgePatch& patch, const Edge* stored) {
  v1::Edge fields;
  if (!fields.ParseFromString(patch.fields)) return NotAPatch("an edge");
  v1::Edge edge;
  if (stored != nullptr) ToProto(*stored, &edge);
  Merge(fields, patch.mask, &edge);
  edge.set_source(ToString(patch.key.source));
  edge.set_relation(patch.key.relation);
  edge.set_target(ToString(patch.key.target));
  return FromProto(edge);
}

// The item of `items` with that key, put there from the store, or as `make` gives it.
template <typename Key, typename Item, typename Patch>
absl::Status PatchItem(const Key& key, const Patch& patch,
                       const std::function<absl::StatusOr<std::optional<Item>>(const Key&)>& find,
                       const std::function<absl::StatusOr<Item>(const Patch&, const Item*)>& make,
                       std::map<Key, size_t>* index_of, std::vector<Item>* items) {
  const auto known = index_of->find(key);
  if (known != index_of->end()) {
    Item& item = (*items)[known->second];
    DSG_ASSIGN_OR_RETURN(item, make(patch, &item));
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const std::optional<Item> stored, find(key));
  DSG_ASSIGN_OR_RETURN(Item made, make(patch, stored.has_value() ? &*stored : nullptr));
  (*index_of)[key] = items->size();
  items->push_back(std::move(made));
  return absl::OkStatus();
}

}  // namespace

absl::Status ApplyPatches(const LayerTable& layers, const PatchSource& source, GraphDelta* delta) {
  LayerTable known = layers;
  for (const Layer& layer : delta->layers) known.Add(layer);
  std::map<NodeId, size_t> node_index;
  if (!delta->node_patches.empty()) {
    for (size_t i = 0; i < delta->nodes.size(); ++i) node_index[delta->nodes[i].id] = i;
  }
  for (const NodePatch& patch : delta->node_patches) {
    DSG_RETURN_IF_ERROR((PatchItem<NodeId, Node, NodePatch>(
        patch.id, patch, source.find_node,
        [&](const NodePatch& one, const Node* stored) { return Patched(one, stored, known); },
        &node_index, &delta->nodes)));
  }
  std::map<EdgeKey, size_t> edge_index;
  if (!delta->edge_patches.empty()) {
    for (size_t i = 0; i < delta->edges.size(); ++i) edge_index[delta->edges[i].key()] = i;
  }
  for (const EdgePatch& patch : delta->edge_patches) {
    DSG_RETURN_IF_ERROR((PatchItem<EdgeKey, Edge, EdgePatch>(
        patch.key, patch, source.find_edge,
        [](const EdgePatch& one, const Edge* stored) { return Patched(one, stored); }, &edge_index,
        &delta->edges)));
  }
  delta->node_patches.clear();
  delta->edge_patches.clear();
  return absl::OkStatus();
}

void MarkWhole(v1::GraphDelta* delta) {
  const std::string all = "*";
  const auto mark = [&all](auto* items) {
    for (auto& item : *items) {
      if (!item.has_update_mask()) item.mutable_update_mask()->add_paths(all);
    }
  };
  mark(delta->mutable_nodes());
  mark(delta->mutable_edges());
}

}  // namespace dsg
