// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_writer.h"

#include "schema/base/check.h"
#include "schema/interop/spark_binary_writer.h"
#include "schema/interop/spark_json_writer.h"

namespace dsg {

absl::Status WriteSpark(const SparkGraph& graph, SparkForm form, const ByteSink& sink) {
  return form == SparkForm::kJson ? WriteSparkAsJson(graph, sink) : WriteSparkAsBinary(graph, sink);
}

std::string SparkToBytes(const SparkGraph& graph, SparkForm form) {
  std::string bytes;
  const absl::Status status = WriteSpark(graph, form, [&bytes](std::string_view piece) {
    bytes += piece;
    return absl::OkStatus();
  });
  DSG_CHECK(status.ok());
  return bytes;
}

nlohmann::json MetadataJson(const std::string& text) {
  nlohmann::json metadata = nlohmann::json::parse(text, nullptr, false);
  return metadata.is_object() ? metadata : nlohmann::json::object();
}

nlohmann::json WithOwn(nlohmann::json metadata, const nlohmann::json& own) {
  if (!metadata.is_object()) metadata = nlohmann::json::object();
  if (!own.is_null()) metadata[kOwnMetadata] = own;
  return metadata;
}

}  // namespace dsg
