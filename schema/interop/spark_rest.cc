// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_rest.h"

#include <algorithm>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/codec/shuffle.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_nodes.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// Shorter ones are packed where they are stored, and can be read by people.
constexpr size_t kPlainBytesMax = 4096;
constexpr size_t kPartBytes = 60'000;
static_assert(kPartBytes <= kAttributeLengthMax);
constexpr size_t kPartCountMax = 32;
constexpr size_t kUnpackedBytesMax = size_t{64} << 20;
constexpr char kPacked = 'z';

std::string PartName(const char* name, size_t part) {
  return part == 0 ? std::string(name) : absl::StrCat(name, "_", part + 1);
}

// Short, since there is one a field; a chance of 1 in 4 billion that a change goes unnoticed.
uint32_t Mark(const Json& value) { return static_cast<uint32_t>(Checksum(DumpJson(value))); }

// What a node of the class and id has under a name when nothing is known of it; nullptr for
// nothing.
const Json* Default(const SparkNode& node, const std::string& name, Json* scratch) {
  if (name != "external_key" || node.type != SparkClass::kAgent) return DefaultFor(node.type, name);
  *scratch = node.id;
  return scratch;
}

// What the map has to say for a kept field to hold. `true`: what it says of any node of the class.
Json MarkOf(const Json& made, const Json* fallback) {
  return fallback != nullptr && made == *fallback ? Json(true) : Json(Mark(made));
}

// Of fields without their defaults: what stands in neither is the same in both.
//
//   [null, value]        the map has no such field
//   [mark, value]        the value that was read
//   [mark]               the field was not there
//   [mark, null, true]   it was what it is in any node of the class
Json Difference(const SparkNode& node, const Json& read, const Json& made) {
  Json kept = Json::object();
  Json scratch;
  for (const auto& [name, value] : read.items()) {
    const Json* fallback = Default(node, name, &scratch);
    const auto found = made.find(name);
    const Json* other = found == made.end() ? fallback : &*found;
    if (other == nullptr) {
      kept[name] = {nullptr, value};
    } else if (*other != value) {
      kept[name] = {MarkOf(*other, fallback), value};
    }
  }
  for (const auto& [name, value] : made.items()) {
    if (read.contains(name)) continue;
    const Json* fallback = Default(node, name, &scratch);
    if (fallback == nullptr) {
      kept[name] = Json::array({Mark(value)});
    } else if (*fallback != value) {
      kept[name] = {Mark(value), nullptr, true};
    }
  }
  return kept;
}

// Attributes can be written by anybody; only what reads as a node of that class is believed.
bool IsReadable(const SparkNode& node, const Json& fields) {
  JsonSource source{"", absl::OkStatus()};
  SparkNode scratch;
  scratch.id = node.id;
  scratch.type = node.type;
  ReadSparkAttributes(JsonFields(fields, "", &source), &source, &scratch);
  return source.ok();
}

void Overlay(const SparkNode& node, const Json& kept, Json* fields) {
  if (!kept.is_object()) return;
  Json scratch;
  for (const auto& [name, entry] : kept.items()) {
    if (!entry.is_array() || entry.empty() || entry.size() > 3 || name == "type") continue;
    const Json* fallback = Default(node, name, &scratch);
    const auto found = fields->find(name);
    const bool is_absent = found == fields->end();
    const bool is_unchanged =
        is_absent ? entry[0].is_null()
                  : entry[0] == MarkOf(*found, fallback) || entry[0] == Json(Mark(*found));
    if (!is_unchanged) continue;
    if (entry.size() == 1) fields->erase(name);
    if (entry.size() == 2) (*fields)[name] = entry[1];
    if (entry.size() == 3 && fallback != nullptr) (*fields)[name] = *fallback;
  }
}

constexpr char kLabelSpaces[] = "labelspaces";

Json PairJson(const SparkLayerKey& key) { return {key.layer, key.partition}; }

SparkLayerKey KeyOfPair(const Json& value) {
  return {PeekSigned(PeekAt(value, 0)), static_cast<uint32_t>(PeekUnsigned(PeekAt(value, 1)))};
}

bool HasSpace(const Json& spaces, const std::string& name, const Json& space) {
  const auto found = spaces.find(name);
  return found != spaces.end() && *found == space;
}

// Metadata without the label spaces that the nodes give again.
Json MetadataRest(const SparkGraph& graph, const GraphDelta& delta) {
  if (!graph.metadata.is_object()) return Json::object();
  Json rest = graph.metadata;
  if (!Peek(rest, kLabelSpaces).is_object()) return rest;
  std::map<NodeId, SparkLayerKey> keys;
  for (const SparkNode& node : graph.nodes) keys[NodeId(node.id)] = node.key;
  const Json made = LabelSpacesOf(delta.nodes, keys);
  Json& spaces = rest[kLabelSpaces];
  for (auto it = spaces.begin(); it != spaces.end();) {
    it = HasSpace(made, it.key(), it.value()) ? spaces.erase(it) : std::next(it);
  }
  if (spaces.empty()) rest.erase(kLabelSpaces);
  return rest;
}

Json RestOf(const SparkGraph& graph, const GraphDelta& delta) {
  std::set<SparkLayerKey> used;
  for (const SparkNode& node : graph.nodes) used.insert(node.key);
  const std::set<SparkLayerKey> listed(graph.layer_keys.begin(), graph.layer_keys.end());
  Json rest = Json::object();
  for (const SparkLayerKey& key : listed) {
    if (!used.contains(key)) rest["layer_keys"].push_back(PairJson(key));
  }
  std::vector<SparkLayerKey> all(listed.begin(), listed.end());
  all.insert(all.end(), used.begin(), used.end());
  const auto standard = StandardLayerNames(all);
  for (const auto& [name, key] : graph.layer_names) {
    const auto found = standard.find(name);
    const bool is_made = found != standard.end() && found->second == key;
    if (!is_made) rest["layer_names"][name] = PairJson(key);
  }
  Json metadata = MetadataRest(graph, delta);
  if (!metadata.empty()) rest["metadata"] = std::move(metadata);
  return rest;
}

void AddMetadata(const Json& kept, Json* metadata) {
  if (!kept.is_object()) return;
  if (!metadata->is_object()) *metadata = Json::object();
  for (const auto& [name, value] : kept.items()) {
    if (name != kLabelSpaces) (*metadata)[name] = value;
  }
  const Json& spaces = Peek(kept, kLabelSpaces);
  if (!spaces.is_object()) return;
  for (const auto& [name, space] : spaces.items()) {
    Json& made = (*metadata)[kLabelSpaces][name];
    if (!space.is_array()) {
      made = space;
      continue;
    }
    // The kept space first, then what nodes have beyond it.
    Json merged = space;
    for (const Json& label : made) {
      const bool is_known = std::any_of(space.begin(), space.end(), [&](const Json& known) {
        return PeekAt(known, 0) == PeekAt(label, 0);
      });
      if (!is_known) merged.push_back(label);
    }
    made = std::move(merged);
  }
}

}  // namespace

bool KeepText(const char* name, const Json& value, Attributes* attributes) {
  std::string text = DumpJson(value);
  if (text.size() > kPlainBytesMax) {
    text = absl::StrCat(std::string(1, kPacked), absl::Base64Escape(Compress(text)));
  }
  const size_t part_count = (text.size() + kPartBytes - 1) / kPartBytes;
  const size_t room = kAttributeCountMax - std::min(kAttributeCountMax, attributes->size());
  if (part_count > std::min(kPartCountMax, room)) return false;
  for (size_t i = 0; i < part_count; ++i) {
    (*attributes)[PartName(name, i)] = text.substr(i * kPartBytes, kPartBytes);
  }
  return true;
}

Json KeptText(const char* name, const Attributes& attributes) {
  std::string text;
  for (size_t i = 0; i < kPartCountMax; ++i) {
    const auto found = attributes.find(PartName(name, i));
    if (found == attributes.end()) break;
    const auto* part = std::get_if<std::string>(&found->second);
    if (part == nullptr) return nullptr;
    text += *part;
  }
  if (text.empty()) return nullptr;
  if (text.front() == kPacked) {
    std::string packed;
    std::string plain;
    const bool is_whole = absl::Base64Unescape(absl::string_view(text).substr(1), &packed) &&
                          Decompress(packed, kUnpackedBytesMax, &plain);
    if (!is_whole) return nullptr;
    text = std::move(plain);
  }
  auto parsed = ParseJson(text, name);
  return parsed.ok() ? *std::move(parsed) : Json();
}

bool KeepRest(const SparkNode& read, const Json& sparse_fields, bool keep_key, Node* node) {
  if (sparse_fields.is_null()) return true;
  Json rest = Json::object();
  if (ClassFor(*node) != read.type) rest["type"] = NameOf(read.type);
  if (keep_key && StandardKeyOf(*node) != read.key) rest["key"] = PairJson(read.key);
  Json fields =
      Difference(read, sparse_fields, MakeSparseFields(ToSpark(*node, read.type, read.key)));
  if (!fields.empty()) rest["fields"] = std::move(fields);
  return rest.empty() || KeepText(attributes::kSparkRest, rest, &node->attributes);
}

SparkNode ToSparkWithRest(const Node& node, const SparkLayerKey& fallback) {
  const Json rest = KeptText(attributes::kSparkRest, node.attributes);
  const Json& type = Peek(rest, "type");
  const auto named = type.is_string() ? SparkClassOf(type.get<std::string>()) : std::nullopt;
  SparkLayerKey key = fallback;
  if (Peek(rest, "key").is_array()) key = KeyOfPair(rest["key"]);
  SparkNode out = ToSpark(node, named.value_or(ClassFor(node)), key);
  out.fields = MakeFields(out);
  if (rest.is_null()) return out;
  Json fields = out.fields;
  Overlay(out, Peek(rest, "fields"), &fields);
  if (IsReadable(out, fields)) out.fields = std::move(fields);
  return out;
}

Json LabelSpacesOf(const std::vector<Node>& nodes, const std::map<NodeId, SparkLayerKey>& keys) {
  std::map<SparkLayerKey, std::map<int32_t, std::string>> names;
  for (const Node& node : nodes) {
    const auto key = keys.find(node.id);
    if (key == keys.end() || node.class_id < 0 || node.class_name.empty()) continue;
    names[key->second].try_emplace(node.class_id, node.class_name);
  }
  Json spaces = Json::object();
  for (const auto& [key, labels] : names) {
    Json& space = spaces[absl::StrCat("_l", key.layer, "p", key.partition)];
    space = Json::array();
    for (const auto& [id, name] : labels) space.push_back({static_cast<uint32_t>(id), name});
  }
  return spaces;
}

bool KeepGraphRest(const SparkGraph& graph, GraphDelta* delta) {
  const Json rest = RestOf(graph, *delta);
  if (rest.empty()) return true;
  const SparkNode* keeper = nullptr;
  for (const SparkNode& node : graph.nodes) {
    const bool is_better = keeper == nullptr || node.key.layer > keeper->key.layer ||
                           (node.key.layer == keeper->key.layer && node.id < keeper->id);
    if (is_better && node.type != SparkClass::kAgent) keeper = &node;
  }
  if (keeper == nullptr) return false;
  // An export says itself what the attributes were.
  if (keeper->own.is_object()) return true;
  for (Node& node : delta->nodes) {
    if (node.id.value != keeper->id) continue;
    return KeepText(attributes::kSparkGraphRest, rest, &node.attributes);
  }
  return false;
}

void AddGraphRest(const std::vector<Node>& nodes, SparkGraph* graph) {
  std::set<SparkLayerKey> keys(graph->layer_keys.begin(), graph->layer_keys.end());
  for (const Node& node : nodes) {
    const Json rest = KeptText(attributes::kSparkGraphRest, node.attributes);
    if (!rest.is_object()) continue;
    const Json& kept_keys = Peek(rest, "layer_keys");
    for (size_t i = 0; kept_keys.is_array() && i < kept_keys.size(); ++i) {
      keys.insert(KeyOfPair(kept_keys[i]));
    }
    const Json& kept_names = Peek(rest, "layer_names");
    if (kept_names.is_object()) {
      for (const auto& [name, key] : kept_names.items()) {
        graph->layer_names[name] = KeyOfPair(key);
      }
    }
    AddMetadata(Peek(rest, "metadata"), &graph->metadata);
  }
  graph->layer_keys.assign(keys.begin(), keys.end());
  for (const auto& [name, key] : StandardLayerNames(graph->layer_keys)) {
    graph->layer_names.try_emplace(name, key);
  }
}

}  // namespace dsg
