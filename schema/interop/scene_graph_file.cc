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

// The first of them names its number an index.
absl::StatusOr<bool> IsKimeraJson(const JsonMembers& members, const std::string& name) {
  const auto nodes = members.find("nodes");
  if (nodes == members.end()) return false;
  JsonCursor cursor(nodes->second.text, name, nodes->second.offset);
  if (cursor.Peek() != '[') return false;
  cursor.BeginArray();
  if (!cursor.NextElement()) return false;
  const nlohmann::json first = cursor.Value();
  if (!cursor.ok()) return cursor.status();
  return first.is_object() && first.contains("index");
}

absl::StatusOr<ImportedGraph> ReadJsonGraph(std::string_view bytes, const std::string& name,
                                            double mesh_block_size_m, const ReadOptions& options) {
  DSG_ASSIGN_OR_RETURN(const JsonMembers members, SplitJson(bytes, name));
  DSG_ASSIGN_OR_RETURN(const bool is_kimera, IsKimeraJson(members, name));
  const bool is_region = members.contains("regions") && members.contains("objects");
  if (is_kimera || is_region) {
    DSG_ASSIGN_OR_RETURN(const nlohmann::json root, ParseJson(bytes, name));
    return is_kimera ? ReadKimeraJson(root, name) : ReadRegionJson(root, name);
  }
  DSG_ASSIGN_OR_RETURN(SparkGraph graph, ReadSparkJson(members, name, options.passed));
  return SparkToDelta(std::move(graph), name, mesh_block_size_m);
}

absl::StatusOr<ImportedGraph> ReadAnyGraph(std::string_view bytes, const std::string& name,
                                           double mesh_block_size_m, const ReadOptions& options) {
  if (!LooksLikeSparkBinary(bytes)) return ReadJsonGraph(bytes, name, mesh_block_size_m, options);
  DSG_ASSIGN_OR_RETURN(SparkGraph graph, ReadSparkBinary(bytes, name));
  return SparkToDelta(std::move(graph), name, mesh_block_size_m);
}

// An empty file of a graph is one; a file of which nothing is left is some other.
bool IsNothingLeft(const ImportedGraph& graph) {
  return graph.node_count == 0 && graph.edge_count == 0 && graph.mesh_vertex_count == 0;
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
                                             double mesh_block_size_m, const ReadOptions& options) {
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
  auto graph = ReadAnyGraph(bytes, name, mesh_block_size_m, options);
  if (!graph.ok() || graph->skipped.empty()) return graph;
  if (options.is_strict) {
    return SkipError(name, graph->skipped, "refused, because the read is strict");
  }
  if (IsNothingLeft(*graph)) {
    return SkipError(name, graph->skipped, "refused, because nothing of the file is left");
  }
  return graph;
}

}  // namespace dsg
