// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/kimera_json.h"

#include <cmath>
#include <set>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

struct Type {
  const char* name;
  char letter;
  LayerId layer;
  int rank;
};

// The type's name is also the node's kind.
constexpr Type kTypes[] = {{kinds::kObject, 'O', layers::kObjects, 200},
                           {kinds::kPlace, 'p', layers::kPlaces, 300},
                           {kinds::kRoom, 'R', layers::kRooms, 400},
                           {kinds::kBuilding, 'B', layers::kBuildings, 500}};

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
    const Type* type = nullptr;
  };

  void ReadNode(const std::string& where, const Json& record) {
    JsonSource source{source_.file, absl::OkStatus()};
    const JsonFields fields(record, where, &source);
    const Type* type = ReadType(fields);
    const uint64_t index = fields.Unsigned("index", NodeId::kIndexMax);
    Node node;
    node.provenance = Provenance::kImported;
    node.map_T_node.position = ReadPoint(fields, "centroid");
    if (fields.Has("node_id")) {
      node.attributes["node_id"] = static_cast<double>(fields.Signed("node_id"));
    }
    if (type != nullptr) {
      node.id = NodeId(type->letter, index);
      node.layer = type->layer;
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

  static const Type* ReadType(const JsonFields& fields) {
    const std::string name = fields.Text("type");
    for (const Type& type : kTypes) {
      if (name == type.name) return &type;
    }
    fields.Fail("type", absl::StrCat("\"", name.substr(0, 64),
                                     "\" is not object, place, room or building"));
    return nullptr;
  }

  static Eigen::Vector3d ReadPoint(const JsonFields& fields, const char* name) {
    Eigen::Vector3d point = fields.Vector(name);
    if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kCoordinateMaxM) {
      fields.Fail(name, absl::StrCat("is not finite or beyond ", kCoordinateMaxM, " m"));
    }
    return point;
  }

  // A number for objects; a text, often just the type again, for the others.
  static void ReadClass(const JsonFields& fields, Node* node) {
    const Json* label = fields.Find("semantic_label");
    if (label == nullptr || label->is_null()) return;
    if (label->is_number()) {
      node->class_id = static_cast<int32_t>(
          fields.Unsigned("semantic_label", std::numeric_limits<int32_t>::max()));
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
    if (word == "At Location" && end.type->rank > start.type->rank) {
      edge.relation = relations::kContains;
      std::swap(edge.source, edge.target);
    }
    return edge;
  }

  static const char* RelationOfNear(const End& start, const End& end) {
    if (start.type != end.type) return relations::kNear;
    if (start.type->layer == layers::kPlaces) return relations::kTraversable;
    if (start.type->layer == layers::kRooms) return relations::kAdjacent;
    return relations::kNear;
  }

  JsonSource source_;
  Skips skips_;
  ImportedGraph result_;
  std::unordered_map<uint64_t, End> ends_;
  std::set<EdgeKey> seen_;
};

}  // namespace

absl::StatusOr<ImportedGraph> ReadKimeraJson(const Json& root, const std::string& file) {
  return KimeraReader(file).Read(root);
}

}  // namespace dsg
