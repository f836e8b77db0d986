// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_metadata.h"

#include <charconv>
#include <optional>

#include "absl/strings/str_cat.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

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
                          entry[1].is_string() &&
                          entry[0].get<uint64_t>() <= std::numeric_limits<int32_t>::max() &&
                          entry[1].get_ref<const std::string&>().size() <= kNameLengthMax;
    if (!is_label) return std::nullopt;
    labels.push_back({entry[0].get<int32_t>(), entry[1].get<std::string>()});
  }
  return labels;
}

}  // namespace

std::string MetadataText(const Json& metadata) {
  if (metadata.is_null() || metadata.empty()) return "";
  return metadata.dump(-1, ' ', false, Json::error_handler_t::replace);
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
