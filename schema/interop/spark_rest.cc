// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_rest.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/codec/shuffle.h"
#include "schema/interop/json_document.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/json_peek.h"
#include "schema/interop/node_to_spark.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_fields.h"
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

std::string Dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string PartName(const char* name, size_t part) {
  return part == 0 ? std::string(name) : absl::StrCat(name, "_", part + 1);
}

// Short, since there is one a field; a chance of 1 in 4 billion that a change goes unnoticed.
uint32_t Mark(const Json& value) { return static_cast<uint32_t>(Checksum(Dump(value))); }

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

}  // namespace

bool KeepText(const char* name, const Json& value, Attributes* attributes) {
  std::string text = Dump(value);
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
  if (keep_key && KeyFor(*node) != read.key) rest["key"] = {read.key.layer, read.key.partition};
  Json fields =
      Difference(read, sparse_fields, MakeSparseFields(ToSpark(*node, read.type, read.key)));
  if (!fields.empty()) rest["fields"] = std::move(fields);
  return rest.empty() || KeepText(kRestAttribute, rest, &node->attributes);
}

SparkNode ToSparkWithRest(const Node& node, const SparkLayerKey& fallback) {
  const Json rest = KeptText(kRestAttribute, node.attributes);
  const Json& type = Peek(rest, "type");
  const auto named = type.is_string() ? SparkClassOf(type.get<std::string>()) : std::nullopt;
  SparkLayerKey key = fallback;
  if (Peek(rest, "key").is_array()) {
    key.layer = PeekSigned(PeekAt(rest["key"], 0));
    key.partition = static_cast<uint32_t>(PeekUnsigned(PeekAt(rest["key"], 1)));
  }
  SparkNode out = ToSpark(node, named.value_or(ClassFor(node)), key);
  out.fields = MakeFields(out);
  if (rest.is_null()) return out;
  Json fields = out.fields;
  Overlay(out, Peek(rest, "fields"), &fields);
  if (IsReadable(out, fields)) out.fields = std::move(fields);
  return out;
}

}  // namespace dsg
