// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_json.h"

#include <limits>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_json_mesh.h"
#include "schema/interop/spark_metadata.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kUint32Max = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kUint64Max = std::numeric_limits<uint64_t>::max();

class SparkJsonReader {
 public:
  explicit SparkJsonReader(const std::string& file) : source_{file, absl::OkStatus()} {}

  absl::StatusOr<SparkGraph> Read(Json json) {
    const JsonFields root(json, "", &source_);
    ReadHeader(root.Object(IsSparkJsonMesh(json) ? "header" : "SPARK_DSG_header", false));
    if (IsSparkJsonMesh(json)) {
      graph_.mesh = ReadSparkJsonMesh(root, &source_);
    } else {
      ReadGraph(root, &json);
    }
    if (!source_.ok()) return source_.status;
    return std::move(graph_);
  }

 private:
  void ReadHeader(const JsonFields& header) {
    if (!header.Has("version")) return;
    const JsonFields version = header.Object("version", true);
    graph_.version = {static_cast<uint8_t>(version.Unsigned("major", 255)),
                      static_cast<uint8_t>(version.Unsigned("minor", 255)),
                      static_cast<uint8_t>(version.Unsigned("patch", 255))};
    if (graph_.version > kSparkVersionNewest) {
      graph_.notes.push_back(absl::StrCat("the file is of version ", ToString(graph_.version),
                                          "; fields newer than version ",
                                          ToString(kSparkVersionNewest), " were not read"));
    }
  }

  // Attributes are moved out of `json`, which `root` reads.
  void ReadGraph(const JsonFields& root, Json* json) {
    if (!root.Has("nodes")) root.Fail("nodes", "is missing; this is no scene graph");
    if (!root.Has("edges")) root.Fail("edges", "is missing; the file may be cut");
    ReadLayerNames(root.Object("layer_names", false), root.Find("layer_names"));
    ReadLayerKeys(root);
    if (const Json* metadata = root.Find("metadata")) ReadGraphMetadata(*metadata, &graph_);
    root.Array("nodes");
    if (!source_.ok()) return;
    for (Json& node : (*json)["nodes"]) {
      if (!source_.ok()) return;
      ReadNode(JsonFields(node, absl::StrCat("nodes[", graph_.nodes.size(), "]"), &source_), &node);
    }
    for (const Json& edge : root.Array("edges")) {
      if (!source_.ok()) return;
      ReadEdge(JsonFields(edge, absl::StrCat("edges[", graph_.edges.size(), "]"), &source_));
    }
    const Json* mesh = root.Find("mesh");
    if (mesh != nullptr && !mesh->is_null()) {
      graph_.mesh = ReadSparkJsonMesh(root.Object("mesh", true), &source_);
    }
    ReadMeshEdges(root);
  }

  // Bare layers before 1.1.2.
  void ReadLayerKeys(const JsonFields& root) {
    for (const Json& key : root.Array("layer_keys")) {
      if (!source_.ok()) return;
      graph_.layer_keys.push_back(ReadLayerKey(JsonFields(key, "layer_keys", &source_)));
    }
    for (const Json& layer : root.Array("layer_ids")) {
      if (layer.is_number_integer()) graph_.layer_keys.push_back({layer.get<int64_t>(), 0});
    }
  }

  // Of old files; what an object lists as its mesh_connections since.
  void ReadMeshEdges(const JsonFields& root) {
    const Json& edges = root.Array("mesh_edges");
    if (edges.empty() || !source_.ok()) return;
    std::unordered_map<uint64_t, SparkNode*> objects;
    for (SparkNode& node : graph_.nodes) {
      const bool is_bare =
          node.fields.contains("mesh_connections") && node.fields["mesh_connections"].empty();
      if (is_bare) objects[node.id] = &node;
    }
    int64_t left_count = 0;
    for (const Json& edge : edges) {
      const JsonFields ends(edge, "mesh_edges", &source_);
      const auto object = objects.find(ends.Unsigned("source", kUint64Max));
      const uint64_t vertex = ends.Unsigned("target", kUint64Max);
      if (!source_.ok()) return;
      if (object == objects.end()) {
        ++left_count;
        continue;
      }
      object->second->fields["mesh_connections"].push_back(vertex);
    }
    for (const auto& [id, object] : objects) {
      AddLength("mesh_connections", object->fields["mesh_connections"].size(), &graph_, object);
    }
    if (left_count > 0) {
      graph_.notes.push_back(
          absl::StrCat(left_count,
                       " edges to mesh vertices from what is no object, or lists such vertices "
                       "itself, were not kept"));
    }
  }

  // Name to {layer, partition}, or to a bare layer before 1.1.1.
  void ReadLayerNames(const JsonFields& names, const Json* values) {
    if (values == nullptr || !source_.ok()) return;
    for (const auto& [name, value] : values->items()) {
      graph_.layer_names[name] = value.is_object() ? ReadLayerKey(names.Object(name.c_str(), true))
                                                   : SparkLayerKey{names.Signed(name.c_str()), 0};
    }
  }

  static SparkLayerKey ReadLayerKey(const JsonFields& key) {
    return {key.Signed("layer"), static_cast<uint32_t>(key.Unsigned("partition", kUint32Max, 0))};
  }

  void ReadNode(const JsonFields& fields, Json* record) {
    SparkNode node;
    node.id = fields.Unsigned("id", kUint64Max);
    node.key = ReadLayerKey(fields);
    const Json* stamp = fields.Find("timestamp");
    if (stamp != nullptr && !stamp->is_null()) {
      node.stamp_ns = fields.Signed("timestamp");
      // Before 1.1.0 the nodes of one robot shared a layer named by the letter of their ids.
      if (!fields.Has("partition")) node.key.partition = static_cast<uint32_t>(node.id >> 56);
    }
    const JsonFields attributes = fields.Object("attributes", true);
    const std::string class_name = attributes.Text("type");
    const auto type = SparkClassOf(class_name);
    if (!type.has_value()) {
      attributes.Fail("type", absl::StrCat("\"", class_name.substr(0, 64),
                                           "\" is no known class of attributes"));
      return;
    }
    node.type = *type;
    ReadSparkAttributes(attributes, &source_, &graph_, &node);
    if (!source_.ok()) return;
    // Moved, since a large file's tree is large.
    FinishNode(std::move(record->at("attributes")), &node);
    graph_.nodes.push_back(std::move(node));
  }

  void ReadEdge(const JsonFields& fields) {
    SparkEdge edge;
    edge.source = fields.Unsigned("source", kUint64Max);
    edge.target = fields.Unsigned("target", kUint64Max);
    const JsonFields info = fields.Object("info", true);
    if (info.Text("type", "EdgeAttributes") != "EdgeAttributes") {
      info.Fail("type", "is no known class of edge attributes");
    }
    edge.weighted = info.Bool("weighted", false);
    edge.weight = info.Number("weight", 1.0);
    if (const Json* metadata = info.Find("metadata")) {
      Json kept = *metadata;
      edge.own = TakeOwn(&kept);
      edge.metadata = MetadataText(kept);
    }
    graph_.edges.push_back(std::move(edge));
  }

  JsonSource source_;
  SparkGraph graph_;
};

}  // namespace

bool IsSparkJsonMesh(const Json& root) {
  return root.is_object() && !root.contains("nodes") &&
         (root.contains("points") || root.contains("vertices") || root.contains("has_colors"));
}

absl::StatusOr<SparkGraph> ReadSparkJson(Json root, const std::string& file) {
  return SparkJsonReader(file).Read(std::move(root));
}

}  // namespace dsg
