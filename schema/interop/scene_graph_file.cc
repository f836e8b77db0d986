// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/scene_graph_file.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"
#include "schema/interop/file_errors.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_binary.h"
#include "schema/interop/spark_json.h"
#include "schema/interop/spark_layers.h"
#include "schema/interop/spark_to_delta.h"
#include "schema/model/delta_check.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr size_t kFileBytesMax = size_t{512} << 20;
constexpr size_t kProbeBytes = 4096;
constexpr std::string_view kBlank = " \t\r\n";

// Of these one is near the beginning of every file that is read, whatever the order of its keys.
constexpr std::string_view kKnownKeys[] = {
    "\"SPARK_DSG_header\"", "\"nodes\"",   "\"edges\"",      "\"directed\"",   "\"layer_ids\"",
    "\"layer_keys\"",       "\"regions\"", "\"has_colors\"", "\"has_labels\"", "\"points\"",
    "\"vertices\"",         "\"colors\"",  "\"faces\""};

struct KimeraType {
  // Also the node's kind.
  const char* name;
  char letter;
};

// The more abstract, the later.
constexpr KimeraType kKimeraTypes[] = {
    {kinds::kObject, 'O'}, {kinds::kPlace, 'p'}, {kinds::kRoom, 'R'}, {kinds::kBuilding, 'B'}};

// The early Kimera form: nodes with index and type, edges with a relation in words. Ids are the
// letter of the type and the node's index; the file's node_id, which is not unique, becomes an
// attribute. "At Location" becomes CONTAINS from the end to the start; "Near" becomes TRAVERSABLE,
// ADJACENT or NEAR; another word stays as it is.
class KimeraReader {
 public:
  explicit KimeraReader(const std::string& file) : source_{file, absl::OkStatus()} {}

  absl::StatusOr<ImportedGraph> Read(const Json& json) {
    const JsonFields root(json, "", &source_);
    if (!root.Has("edges")) root.Fail("edges", "is missing; the file may be cut");
    const Json& nodes = root.Array("nodes");
    for (size_t i = 0; i < nodes.size(); ++i) ReadNode(absl::StrCat("nodes[", i, "]"), nodes[i]);
    const Json& edges = root.Array("edges");
    for (size_t i = 0; i < edges.size(); ++i) ReadEdge(absl::StrCat("edges[", i, "]"), edges[i]);
    if (!source_.ok()) return source_.status;
    result_.format = "kimera-json";
    result_.node_count = static_cast<int64_t>(result_.delta.nodes.size());
    result_.edge_count = static_cast<int64_t>(result_.delta.edges.size());
    result_.skipped = skips_.all();
    result_.notes.push_back(
        "the file has no times; ids were made from the types and indices of its nodes");
    FitBoxesToChildren(&result_.delta);
    return std::move(result_);
  }

 private:
  struct End {
    NodeId id;
    const KimeraType* type = nullptr;
  };

  void ReadNode(const std::string& where, const Json& record) {
    JsonSource source{source_.file, absl::OkStatus()};
    const JsonFields fields(record, where, &source);
    const KimeraType* type = ReadType(fields);
    const uint64_t index = fields.Unsigned("index", NodeId::kIndexMax);
    Node node;
    node.provenance = Provenance::kImported;
    node.map_T_node.position = ReadPoint(fields, "centroid");
    if (fields.Has("node_id")) {
      node.attributes["node_id"] = static_cast<double>(fields.Signed("node_id"));
    }
    if (type != nullptr) {
      node.id = NodeId(type->letter, index);
      node.layer = *LayerOfKind(type->name);
      node.kind = type->name;
      ReadClass(fields, &node);
      ReadSize(fields, &node);
    }
    if (!source.ok()) return skips_.Add(SkipKind::kNode, source.first_where, source.first_what);
    if (!ends_.try_emplace(index, End{node.id, type}).second) {
      return skips_.Add(SkipKind::kRepeatedNode, absl::StrCat(where, ".index"),
                        absl::StrCat(index, " appears twice"));
    }
    result_.delta.nodes.push_back(std::move(node));
  }

  static const KimeraType* ReadType(const JsonFields& fields) {
    const std::string name = fields.Text("type");
    for (const KimeraType& type : kKimeraTypes) {
      if (name == type.name) return &type;
    }
    fields.Fail("type", absl::StrCat("\"", name.substr(0, 64),
                                     "\" is not object, place, room or building"));
    return nullptr;
  }

  static Eigen::Vector3d ReadPoint(const JsonFields& fields, const char* name) {
    Eigen::Vector3d point = fields.Vector(name);
    if (!values::IsSane(point)) {
      fields.Fail(name, absl::StrCat("is not finite or beyond ", kCoordinateMaxM, " m"));
    }
    return point;
  }

  // A number for objects; a text, often just the type again, for the others.
  static void ReadClass(const JsonFields& fields, Node* node) {
    const Json* label = fields.Find("semantic_label");
    if (label == nullptr || label->is_null()) return;
    if (label->is_number()) {
      node->class_id = static_cast<int32_t>(fields.Unsigned("semantic_label", INT32_MAX));
      return;
    }
    const std::string name = fields.Text("semantic_label");
    if (name.size() > kNameLengthMax) fields.Fail("semantic_label", "is too long");
    if (name != node->kind) node->class_name = name;
  }

  static void ReadSize(const JsonFields& fields, Node* node) {
    if (node->kind == kinds::kObject) node->object = ObjectInfo{};
    if (node->kind == kinds::kPlace) node->place = PlaceInfo{};
    const Json* value = fields.Find("size");
    if (value == nullptr || value->is_null()) return;
    const Eigen::Vector3d size = ReadPoint(fields, "size");
    if (!(size.minCoeff() >= 0.0)) return fields.Fail("size", "is negative");
    node->box_node = Box3d(-0.5 * size, 0.5 * size);
    if (node->object.has_value()) node->object->size = size;
  }

  void ReadEdge(const std::string& where, const Json& record) {
    JsonSource source{source_.file, absl::OkStatus()};
    const JsonFields fields(record, where, &source);
    const uint64_t start_index = fields.Unsigned("start", NodeId::kIndexMax);
    const uint64_t end_index = fields.Unsigned("end", NodeId::kIndexMax);
    const std::string word = fields.Text("rel");
    const double weight = fields.Number("weight", 1.0);
    if (word.empty() || word.size() > 64) fields.Fail("rel", "must have 1 to 64 characters");
    if (!std::isfinite(weight)) fields.Fail("weight", "is not finite");
    if (!source.ok()) return skips_.Add(SkipKind::kEdge, source.first_where, source.first_what);
    const auto start = ends_.find(start_index);
    const auto end = ends_.find(end_index);
    if (start == ends_.end() || end == ends_.end()) {
      const bool is_start = start == ends_.end();
      return skips_.Add(
          SkipKind::kDanglingEdge, where + (is_start ? ".start" : ".end"),
          absl::StrCat("node ", is_start ? start_index : end_index, " is not in the file"));
    }
    if (start_index == end_index) {
      return skips_.Add(SkipKind::kLoopEdge, absl::StrCat(where, ".end"), "is also the start");
    }
    Edge edge = MakeEdge(start->second, end->second, word);
    edge.weight = weight;
    if (!seen_.insert(edge.key()).second) {
      return skips_.Add(SkipKind::kRepeatedEdge, absl::StrCat(where, ".start"), "repeats an edge");
    }
    result_.delta.edges.push_back(std::move(edge));
  }

  static Edge MakeEdge(const End& start, const End& end, const std::string& word) {
    Edge edge;
    edge.source = start.id;
    edge.target = end.id;
    edge.relation = word;
    if (word == "Near") edge.relation = RelationOfNear(start, end);
    if (word == "At Location" && end.type > start.type) {
      edge.relation = relations::kContains;
      std::swap(edge.source, edge.target);
    }
    return edge;
  }

  static const char* RelationOfNear(const End& start, const End& end) {
    return start.type == end.type ? SiblingRelation(*LayerOfKind(start.type->name))
                                  : relations::kNear;
  }

  JsonSource source_;
  Skips skips_;
  ImportedGraph result_;
  std::unordered_map<uint64_t, End> ends_;
  std::set<EdgeKey> seen_;
};

// "O(470)".
std::optional<NodeId> RegionIdOf(std::string_view text, char letter) {
  if (text.size() < 4 || text[0] != letter || text[1] != '(' || text.back() != ')') {
    return std::nullopt;
  }
  uint64_t index = 0;
  const char* const end = text.data() + text.size() - 1;
  const auto result = std::from_chars(text.data() + 2, end, index);
  if (result.ec != std::errc() || result.ptr != end || index > NodeId::kIndexMax) {
    return std::nullopt;
  }
  return NodeId(letter, index);
}

// "(5.938, -0.921)".
std::optional<Eigen::Vector3d> RegionCenterOf(std::string_view text) {
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
  const std::string inner(text.substr(1, text.size() - 2));
  const std::vector<std::string> parts = absl::StrSplit(inner, ',');
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  const bool is_pair = parts.size() == 2 && absl::SimpleAtod(parts[0], &center.x()) &&
                       absl::SimpleAtod(parts[1], &center.y());
  return is_pair && values::IsSane(center) ? std::optional(center) : std::nullopt;
}

// The digest of a scene graph as regions and labelled objects with centres, without geometry.
// Regions "R(1)" become rooms and objects "O(2)" objects, each under its parent region. Centres are
// "(x, y)"; z is 0, which a note says.
class RegionReader {
 public:
  explicit RegionReader(const std::string& file) : source_{file, absl::OkStatus()} {}

  absl::StatusOr<ImportedGraph> Read(const Json& json) {
    const JsonFields root(json, "", &source_);
    ReadNodes(root, "regions", 'R');
    ReadNodes(root, "objects", 'O');
    if (!source_.ok()) return source_.status;
    GraphDelta& delta = result_.delta;
    result_.format = "region-json";
    result_.node_count = static_cast<int64_t>(delta.nodes.size());
    result_.edge_count = static_cast<int64_t>(delta.edges.size());
    result_.notes.push_back("the file has no heights, extents or times; z is 0");
    result_.skipped = skips_.all();
    FitBoxesToChildren(&delta);
    return std::move(result_);
  }

 private:
  void ReadNodes(const JsonFields& root, const char* name, char letter) {
    const JsonFields items = root.Object(name, true);
    if (!source_.ok()) return;
    for (const auto& [key, value] : root.Find(name)->items()) {
      if (!source_.ok()) return;
      const std::string where = absl::StrCat(name, ".", key.substr(0, 64));
      const auto id = RegionIdOf(key, letter);
      if (!id.has_value()) {
        return source_.Fail(where, absl::StrCat("is not named ", std::string(1, letter), "(n)"));
      }
      ReadNode(JsonFields(value, where, &source_), *id);
    }
  }

  void ReadNode(const JsonFields& fields, NodeId id) {
    const bool is_region = id.letter() == 'R';
    Node node;
    node.id = id;
    node.layer = is_region ? layers::kRooms : layers::kObjects;
    node.kind = is_region ? kinds::kRoom : kinds::kObject;
    node.provenance = Provenance::kImported;
    node.class_name = fields.Text("semantic_label", "");
    if (node.class_name.size() > kNameLengthMax) fields.Fail("semantic_label", "is too long");
    const auto center = RegionCenterOf(fields.Text("center"));
    if (!center.has_value()) return fields.Fail("center", "is not \"(x, y)\" in metres");
    node.map_T_node.position = *center;
    if (is_region) {
      node.region = RegionInfo{};
    } else {
      node.object = ObjectInfo{};
      AddParent(fields, id);
    }
    ids_.insert(id);
    result_.delta.nodes.push_back(std::move(node));
  }

  void AddParent(const JsonFields& fields, NodeId id) {
    const Json* parent = fields.Find("parent_region");
    if (parent == nullptr || parent->is_null() || *parent == "none") return;
    const auto region = RegionIdOf(fields.Text("parent_region"), 'R');
    if (!region.has_value() || !ids_.contains(*region)) {
      return skips_.Add(SkipKind::kDanglingEdge, absl::StrCat(fields.where(), ".parent_region"),
                        "is no region of the file");
    }
    Edge edge;
    edge.source = *region;
    edge.relation = relations::kContains;
    edge.target = id;
    result_.delta.edges.push_back(std::move(edge));
  }

  JsonSource source_;
  Skips skips_;
  ImportedGraph result_;
  std::unordered_set<NodeId> ids_;
};

// The first of them names its number an index.
absl::StatusOr<bool> IsKimeraJson(const JsonMembers& members, const std::string& name) {
  const auto nodes = members.find("nodes");
  if (nodes == members.end()) return false;
  JsonCursor cursor(nodes->second.text, name, nodes->second.offset);
  if (cursor.Peek() != '[') return false;
  cursor.BeginArray();
  if (!cursor.NextElement()) return false;
  const Json first = cursor.Value();
  if (!cursor.ok()) return cursor.status();
  return first.is_object() && first.contains("index");
}

absl::StatusOr<ImportedGraph> ReadJsonGraph(std::string_view bytes, const std::string& name,
                                            double mesh_block_size_m, const ReadOptions& options) {
  DSG_ASSIGN_OR_RETURN(const JsonMembers members, SplitJson(bytes, name));
  DSG_ASSIGN_OR_RETURN(const bool is_kimera, IsKimeraJson(members, name));
  const bool is_region = members.contains("regions") && members.contains("objects");
  if (is_kimera || is_region) {
    DSG_ASSIGN_OR_RETURN(const Json root, ParseJson(bytes, name));
    return is_kimera ? KimeraReader(name).Read(root) : RegionReader(name).Read(root);
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
