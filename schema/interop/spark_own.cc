// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_own.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/interop/json_document.h"
#include "schema/interop/json_peek.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// Text and trees of a chunk are in memory at once.
constexpr size_t kChunk = 2048;

std::string Dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::vector<Json> ItemsOf(const GraphDelta& delta, const char* name) {
  std::vector<Json> items;
  Json root = Json::parse(DeltaToJson(delta), nullptr, false);
  if (!Peek(root, name).is_array()) return items;
  for (Json& item : root[name]) {
    item.erase("revision");
    items.push_back(std::move(item));
  }
  return items;
}

template <typename T>
std::vector<Json> ToJson(const std::vector<T>& all, const std::vector<Layer>& layers,
                         std::vector<T> GraphDelta::*part, const char* name) {
  std::vector<Json> items;
  items.reserve(all.size());
  for (size_t begin = 0; begin < all.size(); begin += kChunk) {
    GraphDelta delta;
    delta.layers = layers;
    const size_t end = std::min(all.size(), begin + kChunk);
    (delta.*part)
        .assign(all.begin() + static_cast<std::ptrdiff_t>(begin),
                all.begin() + static_cast<std::ptrdiff_t>(end));
    for (Json& item : ItemsOf(delta, name)) items.push_back(std::move(item));
  }
  return items;
}

template <typename T>
absl::StatusOr<std::vector<T>> FromJson(const std::vector<Json>& all, const Json& layers,
                                        std::vector<T> GraphDelta::*part, const char* name) {
  std::vector<T> items;
  items.reserve(all.size());
  for (size_t begin = 0; begin < all.size(); begin += kChunk) {
    Json root = {{"layers", layers}, {name, Json::array()}};
    const size_t end = std::min(all.size(), begin + kChunk);
    for (size_t i = begin; i < end; ++i) root[name].push_back(all[i]);
    DSG_ASSIGN_OR_RETURN(GraphDelta delta, DeltaFromJson(Dump(root)));
    for (T& item : delta.*part) items.push_back(std::move(item));
  }
  return items;
}

}  // namespace

std::vector<Json> NodesToJson(const std::vector<Node>& nodes, const std::vector<Layer>& layers) {
  return ToJson(nodes, layers, &GraphDelta::nodes, "nodes");
}

std::vector<Json> EdgesToJson(const std::vector<Edge>& edges) {
  return ToJson(edges, {}, &GraphDelta::edges, "edges");
}

absl::StatusOr<std::vector<Node>> NodesFromJson(const std::vector<Json>& nodes,
                                                const std::vector<Layer>& layers) {
  Json named = Json::array();
  for (const Layer& layer : layers) {
    named.push_back({{"id", layer.id}, {"name", layer.name}, {"rank", layer.rank}});
  }
  return FromJson(nodes, named, &GraphDelta::nodes, "nodes");
}

absl::StatusOr<std::vector<Edge>> EdgesFromJson(const std::vector<Json>& edges) {
  return FromJson(edges, Json::array(), &GraphDelta::edges, "edges");
}

Json Patch(const Json& from, const Json& to) {
  Json patch = Json::object();
  for (const auto& [name, value] : to.items()) {
    const auto found = from.find(name);
    if (found == from.end() || *found != value) patch[name] = value;
  }
  for (const auto& [name, value] : from.items()) {
    if (!to.contains(name)) patch[name] = nullptr;
  }
  return patch.empty() ? Json() : patch;
}

void ApplyPatch(const Json& patch, Json* node) {
  if (!patch.is_object()) return;
  for (const auto& [name, value] : patch.items()) {
    if (name == "id") continue;
    if (value.is_null()) {
      node->erase(name);
    } else {
      (*node)[name] = value;
    }
  }
}

}  // namespace dsg
