// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/scene_graph_file.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_error.h"
#include "schema/interop/json_document.h"
#include "schema/interop/kimera_json.h"
#include "schema/interop/region_json.h"
#include "schema/interop/spark_binary.h"
#include "schema/interop/spark_json.h"
#include "schema/interop/spark_to_delta.h"

namespace dsg {
namespace {

constexpr size_t kFileBytesMax = size_t{512} << 20;
constexpr size_t kProbeBytes = 4096;
constexpr std::string_view kBlank = " \t\r\n";

// Of these one is near the beginning of every file that is read, whatever the order of its keys.
constexpr std::string_view kKnownKeys[] = {
    "\"SPARK_DSG_header\"", "\"nodes\"",   "\"edges\"",      "\"directed\"",   "\"layer_ids\"",
    "\"layer_keys\"",       "\"regions\"", "\"has_colors\"", "\"has_labels\"", "\"points\"",
    "\"vertices\"",         "\"colors\"",  "\"faces\""};

absl::StatusOr<ImportedGraph> ReadJsonGraph(std::string_view bytes, const std::string& name,
                                            double mesh_block_size_m) {
  DSG_ASSIGN_OR_RETURN(nlohmann::json root, ParseJson(bytes, name));
  if (IsKimeraJson(root)) return ReadKimeraJson(root, name);
  if (IsRegionJson(root)) return ReadRegionJson(root, name);
  DSG_ASSIGN_OR_RETURN(const SparkGraph graph, ReadSparkJson(std::move(root), name));
  return SparkToDelta(graph, name, mesh_block_size_m);
}

}  // namespace

bool LooksLikeSceneGraph(std::string_view bytes) {
  if (LooksLikeSparkBinary(bytes)) return true;
  const size_t begin = bytes.find_first_not_of(kBlank);
  if (begin == std::string_view::npos || bytes[begin] != '{') return false;
  const std::string_view head = bytes.substr(begin, kProbeBytes);
  for (const std::string_view key : kKnownKeys) {
    if (head.find(key) != std::string_view::npos) return true;
  }
  return false;
}

absl::StatusOr<ImportedGraph> ReadSceneGraph(std::string_view bytes, const std::string& name,
                                             double mesh_block_size_m) {
  if (!(mesh_block_size_m >= 0.1 && mesh_block_size_m <= 100.0)) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("mesh_block_size_m is ", mesh_block_size_m, "; it must be from 0.1 to 100"),
        {{"field", "mesh_block_size_m"}});
  }
  if (bytes.size() > kFileBytesMax) {
    return FileError(
        name, "the file",
        absl::StrCat("has ", bytes.size(), " bytes; at most ", kFileBytesMax, " are read"));
  }
  if (bytes.find_first_not_of(kBlank) == std::string_view::npos) {
    return FileError(name, "the file", "is empty");
  }
  if (!LooksLikeSparkBinary(bytes)) return ReadJsonGraph(bytes, name, mesh_block_size_m);
  DSG_ASSIGN_OR_RETURN(const SparkGraph graph, ReadSparkBinary(bytes, name));
  return SparkToDelta(graph, name, mesh_block_size_m);
}

}  // namespace dsg
