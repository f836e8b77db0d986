// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_json.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_errors.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_mesh.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// Often enough that little of a passed text stays, seldom enough to cost nothing.
constexpr size_t kPassedBytes = size_t{4} << 20;
// So many elements tell how long the others are; no more are expected, whatever they tell.
constexpr size_t kSampleCount = 64;
constexpr size_t kReserveMax = 500'000;

// What a graph can have thousands of is not read with the rest.
constexpr const char* kLongMembers[] = {"nodes", "edges"};

bool IsLong(const std::string& name) {
  return std::find(std::begin(kLongMembers), std::end(kLongMembers), name) !=
         std::end(kLongMembers);
}

// Of nearly all edges.
const UsualMembers& UsualEdge() {
  static const UsualMembers usual = {"info",
                                     {{"metadata", "{}"},
                                      {"type", "\"EdgeAttributes\""},
                                      {"weight", "1.0"},
                                      {"weighted", "false"}}};
  return usual;
}

class SparkJsonReader {
 public:
  SparkJsonReader(const std::string& file, const PassedText& passed)
      : source_{file, absl::OkStatus()}, passed_(passed) {}

  absl::StatusOr<SparkGraph> Read(const JsonMembers& members) {
    Json json = Json::object();
    for (const auto& [name, text] : members) {
      if (!source_.ok()) return source_.status;
      const bool is_later = members.contains("nodes") && IsLong(name);
      if (!is_later) json[name] = ValueOf(text);
    }
    const JsonFields root(json, "", &source_);
    const bool is_mesh = IsSparkJsonMesh(members);
    ReadHeader(root.Object(is_mesh ? "header" : "SPARK_DSG_header", false));
    if (is_mesh) {
      graph_.mesh = ReadSparkJsonMesh(root, &source_);
    } else {
      ReadGraph(root, members);
    }
    if (!source_.ok()) return source_.status;
    return std::move(graph_);
  }

 private:
  Json ValueOf(const JsonText& member) {
    JsonCursor cursor(member.text, source_.file, member.offset);
    Json value = cursor.Value();
    cursor.End();
    if (!cursor.ok() && source_.ok()) source_.status = cursor.status();
    return value;
  }

  // A node without the fields that have the defaults of its class: most fields of most nodes. The
  // class stands behind most fields, so that of the node before is tried.
  Json NodeValue(const JsonText& member, JsonCursor* cursor) {
    const size_t begin = cursor->offset();
    Json node = cursor->Value(usual_);
    const UsualMembers* const own = UsualOf(Peek(Peek(node, "attributes"), "type"));
    if (own == usual_) return node;
    usual_ = own;
    if (!cursor->ok()) return node;
    JsonCursor again(member.text.substr(begin, cursor->offset() - begin), source_.file,
                     member.offset + begin);
    return again.Value();
  }

  // nullptr for a name that is none.
  const UsualMembers* UsualOf(const Json& name) {
    if (!name.is_string()) return nullptr;
    const auto type = SparkClassOf(name.get_ref<const std::string&>());
    if (!type.has_value()) return nullptr;
    const auto known = classes_.find(*type);
    if (known != classes_.end()) return &known->second;
    return &classes_.emplace(*type, UsualMembers{"attributes", UsualTexts(*type)}).first->second;
  }

  // Calls `read` with the place and the value of each element, which puts it into `items`.
  template <typename T, typename ReadOne>
  void ForEach(const char* name, const JsonMembers& members, std::vector<T>* items,
               const ReadOne& read) {
    if (!source_.ok()) return;
    const JsonText& member = members.at(name);
    JsonCursor cursor(member.text, source_.file, member.offset);
    if (cursor.Peek() != '[') {
      const Json value = ValueOf(member);
      if (source_.ok() && !value.is_null()) source_.Fail(name, ExpectedArray(value));
      return;
    }
    size_t done = 0;
    size_t count = 0;
    for (cursor.BeginArray(); cursor.NextElement();) {
      Json element =
          std::is_same_v<T, SparkNode> ? NodeValue(member, &cursor) : cursor.Value(&UsualEdge());
      if (!cursor.ok()) break;
      read(absl::StrCat(name, "[", count++, "]"), &element);
      // A list that grows is in memory twice, and its items are copied.
      if (count == kSampleCount) {
        items->reserve(
            std::min(kReserveMax, member.text.size() / (cursor.offset() / count) + count));
      }
      if (passed_ == nullptr || cursor.offset() - done < kPassedBytes) continue;
      passed_(member.text.substr(done, cursor.offset() - done));
      done = cursor.offset();
    }
    cursor.End();
    if (!cursor.ok()) source_.status = cursor.status();
  }

  static std::string ExpectedArray(const Json& value) {
    return absl::StrCat("is ", value.type_name(), "; expected an array");
  }

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

  void ReadGraph(const JsonFields& root, const JsonMembers& members) {
    if (!members.contains("nodes")) root.Fail("nodes", "is missing; this is no scene graph");
    if (!members.contains("edges")) root.Fail("edges", "is missing; the file may be cut");
    ReadLayerNames(root.Object("layer_names", false), root.Find("layer_names"));
    ReadLayerKeys(root);
    if (const Json* metadata = root.Find("metadata")) ReadGraphMetadata(*metadata, &graph_);
    const Json* mesh = root.Find("mesh");
    if (mesh != nullptr && !mesh->is_null()) {
      graph_.mesh = ReadSparkJsonMesh(root.Object("mesh", true), &source_);
    }
    ReadMeshEdges(root);
    ForEach("nodes", members, &graph_.nodes,
            [this](const std::string& where, Json* node) { ReadNode(where, node); });
    NoteMeshEdges();
    ForEach("edges", members, &graph_.edges,
            [this](const std::string& where, Json* edge) { ReadEdge(where, *edge); });
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
    for (const Json& edge : root.Array("mesh_edges")) {
      JsonSource source{source_.file, absl::OkStatus()};
      const JsonFields ends(edge, "mesh_edges", &source);
      const uint64_t object = ends.Unsigned("source", UINT64_MAX);
      const uint64_t vertex = ends.Unsigned("target", UINT64_MAX);
      if (!source.ok()) {
        Skip(SkipKind::kEdge, source);
      } else {
        vertices_of_[object].push_back(vertex);
      }
    }
  }

  void TakeMeshEdges(SparkNode* node) {
    const auto vertices = vertices_of_.find(node->id);
    if (vertices == vertices_of_.end()) return;
    if (node->type != SparkClass::kObject && node->type != SparkClass::kKhronosObject) return;
    Json& list = node->fields["mesh_connections"];
    if (!list.empty()) return;
    list = vertices->second;
    AddLength("mesh_connections", vertices->second.size(), node);
    vertices_of_.erase(vertices);
  }

  void NoteMeshEdges() {
    size_t left_count = 0;
    for (const auto& [id, vertices] : vertices_of_) left_count += vertices.size();
    if (left_count == 0) return;
    graph_.notes.push_back(
        absl::StrCat(left_count,
                     " edges to mesh vertices from what is no object, or lists such vertices "
                     "itself, were not kept"));
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
    return {key.Signed("layer"), static_cast<uint32_t>(key.Unsigned("partition", UINT32_MAX, 0))};
  }

  // One that is no node is counted, and the file is read on.
  void ReadNode(const std::string& where, Json* record) {
    JsonSource source{source_.file, absl::OkStatus()};
    const JsonFields fields(*record, where, &source);
    SparkNode node;
    node.id = fields.Unsigned("id", UINT64_MAX);
    node.key = ReadLayerKey(fields);
    const Json* stamp = fields.Find("timestamp");
    if (stamp != nullptr && !stamp->is_null()) {
      node.stamp_ns = fields.Signed("timestamp");
      // Before 1.1.0 the nodes of one robot shared a layer named by the letter of their ids.
      if (!fields.Has("partition")) node.key.partition = static_cast<uint32_t>(node.id >> 56);
    }
    fields.Object("attributes", true);
    if (!source.ok()) return Skip(SkipKind::kNode, source);
    Json attributes = std::move(record->at("attributes"));
    const std::string within = absl::StrCat(where, ".attributes");
    node.type = ReadSparkClass(within, attributes, &graph_.skips);
    const absl::Status read =
        ReadWhatCanBeRead(source_.file, within, &attributes, &graph_.skips, &node);
    if (!read.ok()) return graph_.skips.Add(SkipKind::kNode, within, std::string(read.message()));
    FinishNode(std::move(attributes), &node);
    TakeMeshEdges(&node);
    PackFields(&node);
    graph_.nodes.push_back(std::move(node));
  }

  void ReadEdge(const std::string& where, const Json& record) {
    JsonSource source{source_.file, absl::OkStatus()};
    const JsonFields fields(record, where, &source);
    SparkEdge edge;
    edge.source = fields.Unsigned("source", UINT64_MAX);
    edge.target = fields.Unsigned("target", UINT64_MAX);
    const JsonFields info = fields.Object("info", true);
    if (info.Text("type", "EdgeAttributes") != "EdgeAttributes") {
      info.Fail("type", "is no known class of edge attributes");
    }
    edge.weighted = info.Bool("weighted", false);
    edge.weight = info.Number("weight", 1.0);
    if (!source.ok()) return Skip(SkipKind::kEdge, source);
    if (const Json* metadata = info.Find("metadata")) {
      Json kept = *metadata;
      edge.own = TakeOwn(&kept);
      edge.metadata = MetadataText(kept);
    }
    graph_.edges.push_back(std::move(edge));
  }

  void Skip(SkipKind kind, const JsonSource& source) {
    graph_.skips.Add(kind, source.first_where, source.first_what);
  }

  JsonSource source_;
  const PassedText& passed_;
  /// Of objects that have not come yet.
  std::unordered_map<uint64_t, std::vector<uint64_t>> vertices_of_;
  std::map<SparkClass, UsualMembers> classes_;
  /// Of the class of the node that was read last; nullptr if that is not known.
  const UsualMembers* usual_ = nullptr;
  SparkGraph graph_;
};

}  // namespace

bool IsSparkJsonMesh(const JsonMembers& members) {
  return !members.contains("nodes") &&
         (members.contains("points") || members.contains("vertices") ||
          members.contains("has_colors"));
}

absl::StatusOr<JsonMembers> SplitJson(std::string_view text, const std::string& file) {
  JsonCursor cursor(text, file);
  JsonMembers members;
  if (cursor.Peek() != '{') {
    const Json value = cursor.Value();
    if (!cursor.ok()) return cursor.status();
    return FileError(file, "the file",
                     absl::StrCat("is ", value.type_name(), "; expected an object"));
  }
  std::string key;
  for (cursor.BeginObject(); cursor.NextKey(&key);) {
    const std::string_view value = cursor.Skip();
    const size_t offset = cursor.offset() - value.size();
    if (!members.try_emplace(key, JsonText{value, offset}).second) {
      return FileError(file, absl::StrCat("key \"", key.substr(0, 64), "\""),
                       "appears twice in one object; remove one of the two");
    }
  }
  cursor.End();
  if (!cursor.ok()) return cursor.status();
  return members;
}

absl::StatusOr<SparkGraph> ReadSparkJson(const JsonMembers& members, const std::string& file,
                                         const PassedText& passed) {
  return SparkJsonReader(file, passed).Read(members);
}

}  // namespace dsg
