// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_graph.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_metadata.h"

namespace dsg {
namespace {

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

nlohmann::json TakeOwn(nlohmann::json* metadata) {
  if (!metadata->is_object()) return nullptr;
  const auto found = metadata->find(kOwnMetadata);
  if (found == metadata->end()) return nullptr;
  nlohmann::json own = std::move(*found);
  metadata->erase(found);
  return own;
}

void FinishNode(nlohmann::json attributes, SparkNode* node) {
  attributes["type"] = NameOf(node->type);
  // On the node itself before 1.1.0.
  const bool is_timed = node->type == SparkClass::kAgent && node->stamp_ns.has_value();
  if (is_timed) attributes["timestamp"] = *node->stamp_ns;
  UpgradeForms(node->type, &attributes);
  nlohmann::json& metadata = attributes["metadata"];
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
      nlohmann::json::to_cbor(WithoutDefaults(node->type, node->id, std::move(node->fields)));
  node->packed_fields.shrink_to_fit();
  node->fields = nullptr;
}

nlohmann::json SparseFieldsOf(const SparkNode& node) {
  if (node.packed_fields.empty()) return WithoutDefaults(node.type, node.id, node.fields);
  return nlohmann::json::from_cbor(node.packed_fields);
}

nlohmann::json AllFieldsOf(const SparkNode& node) {
  if (node.packed_fields.empty()) return node.fields;
  nlohmann::json fields = SparseFieldsOf(node);
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

TimeNs StampOrZero(uint64_t stamp_ns) {
  return stamp_ns <= static_cast<uint64_t>(kTimeMax) ? static_cast<TimeNs>(stamp_ns) : 0;
}

}  // namespace dsg
