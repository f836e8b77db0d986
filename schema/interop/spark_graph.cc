// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_graph.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_fields.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr std::pair<std::string_view, SparkClass> kClassNames[] = {
    {"NodeAttributes", SparkClass::kNode},
    {"SemanticNodeAttributes", SparkClass::kSemantic},
    {"ObjectNodeAttributes", SparkClass::kObject},
    {"KhronosObjectAttributes", SparkClass::kKhronosObject},
    {"RoomNodeAttributes", SparkClass::kRoom},
    {"PlaceNodeAttributes", SparkClass::kPlace},
    {"Place2dNodeAttributes", SparkClass::kPlace2d},
    {"AgentNodeAttributes", SparkClass::kAgent},
    {"TraversabilityNodeAttributes", SparkClass::kTraversability},
    // An alias of the places' class; last, so that NameOf finds the class's own name first.
    {"FrontierNodeAttributes", SparkClass::kPlace},
};

// "_l2p0" or "_l2".
std::optional<SparkLayerKey> LabelSpaceKey(const std::string& name) {
  if (name.rfind("_l", 0) != 0) return std::nullopt;
  const char* const end = name.data() + name.size();
  SparkLayerKey key;
  auto result = std::from_chars(name.data() + 2, end, key.layer);
  if (result.ec != std::errc()) return std::nullopt;
  if (result.ptr == end) return key;
  if (*result.ptr != 'p') return std::nullopt;
  result = std::from_chars(result.ptr + 1, end, key.partition);
  if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return key;
}

std::optional<std::vector<SemanticLabel>> LabelsOf(const Json& space) {
  if (!space.is_array()) return std::nullopt;
  std::vector<SemanticLabel> labels;
  for (const Json& entry : space) {
    const bool is_label = entry.is_array() && entry.size() == 2 && entry[0].is_number_unsigned() &&
                          entry[1].is_string() && entry[0].get<uint64_t>() <= INT32_MAX &&
                          entry[1].get_ref<const std::string&>().size() <= kNameLengthMax;
    if (!is_label) return std::nullopt;
    labels.push_back({entry[0].get<int32_t>(), entry[1].get<std::string>()});
  }
  return labels;
}

}  // namespace

std::string ToString(const SparkVersion& version) {
  return absl::StrCat(version.major, ".", version.minor, ".", version.patch);
}

std::optional<SparkClass> SparkClassOf(std::string_view name) {
  for (const auto& [known, type] : kClassNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

std::string_view NameOf(SparkClass type) {
  for (const auto& [name, known] : kClassNames) {
    if (known == type) return name;
  }
  return "";
}

bool IsSemantic(SparkClass type) {
  return type != SparkClass::kNode && type != SparkClass::kAgent &&
         type != SparkClass::kTraversability;
}

Json TakeOwn(Json* metadata) {
  if (!metadata->is_object()) return nullptr;
  const auto found = metadata->find(kOwnMetadata);
  if (found == metadata->end()) return nullptr;
  Json own = std::move(*found);
  metadata->erase(found);
  return own;
}

void FinishNode(Json attributes, SparkNode* node) {
  attributes["type"] = NameOf(node->type);
  // On the node itself before 1.1.0.
  const bool is_timed = node->type == SparkClass::kAgent && node->stamp_ns.has_value();
  if (is_timed) attributes["timestamp"] = *node->stamp_ns;
  UpgradeForms(node->type, &attributes);
  Json& metadata = attributes["metadata"];
  node->own = TakeOwn(&metadata);
  if (!node->own.is_null()) {
    node->attributes.erase("metadata");
    std::string text = MetadataText(metadata);
    if (!text.empty()) node->attributes["metadata"] = std::move(text);
  }
  node->fields = std::move(attributes);
}

void PackFields(SparkNode* node) {
  if (node->fields.is_null()) return;
  node->packed_fields =
      Json::to_cbor(WithoutDefaults(node->type, node->id, std::move(node->fields)));
  node->packed_fields.shrink_to_fit();
  node->fields = nullptr;
}

Json SparseFieldsOf(const SparkNode& node) {
  if (node.packed_fields.empty()) return WithoutDefaults(node.type, node.id, node.fields);
  return Json::from_cbor(node.packed_fields);
}

Json AllFieldsOf(const SparkNode& node) {
  if (node.packed_fields.empty()) return node.fields;
  Json fields = SparseFieldsOf(node);
  fields["type"] = NameOf(node.type);
  UpgradeFields(node.type, node.id, &fields);
  return fields;
}

void AddLength(const char* name, size_t length, SparkNode* node) {
  if (length != 0) node->attributes[name] = static_cast<double>(length);
}

void AddFlag(const char* name, bool value, SparkNode* node) {
  if (value) node->attributes[name] = true;
}

void AddNumber(const std::string& name, double value, SparkNode* node) {
  if (std::isnormal(value)) node->attributes[name] = value;
}

uint64_t SparkStampOf(TimeNs time_ns) { return time_ns > 0 ? static_cast<uint64_t>(time_ns) : 0; }

TimeNs StampOrZero(uint64_t stamp_ns) {
  return stamp_ns <= static_cast<uint64_t>(kTimeMax) ? static_cast<TimeNs>(stamp_ns) : 0;
}

std::string MetadataText(const Json& metadata) {
  if (metadata.is_null() || metadata.empty()) return "";
  return DumpJson(metadata);
}

Json MetadataJson(const std::string& text) {
  Json metadata = Json::parse(text, nullptr, false);
  return metadata.is_object() ? metadata : Json::object();
}

Json WithOwn(Json metadata, const Json& own) {
  if (!metadata.is_object()) metadata = Json::object();
  if (!own.is_null()) metadata[kOwnMetadata] = own;
  return metadata;
}

void ReadGraphMetadata(const Json& metadata, SparkGraph* graph) {
  if (!metadata.is_object()) return;
  graph->metadata = metadata;
  graph->own = TakeOwn(&graph->metadata);
  for (const auto& [name, value] : metadata.items()) {
    if (name != "labelspaces" || !value.is_object()) continue;
    for (const auto& [space_name, space] : value.items()) {
      const auto key = LabelSpaceKey(space_name);
      auto labels = LabelsOf(space);
      if (key.has_value() && labels.has_value()) {
        graph->label_spaces[*key] = *std::move(labels);
      } else {
        graph->notes.push_back(
            absl::StrCat("label space \"", space_name.substr(0, 64), "\" was not understood"));
      }
    }
  }
}

}  // namespace dsg
