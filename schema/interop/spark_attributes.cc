// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_attributes.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_graph.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

class AttributesReader {
 public:
  explicit AttributesReader(JsonSource* source) : source_(*source) {}

  void ReadAttributes(const JsonFields& fields, SparkNode* node) {
    if (const Json* metadata = fields.Find("metadata")) {
      std::string text = MetadataText(*metadata);
      if (!text.empty()) node->attributes["metadata"] = std::move(text);
    }
    node->position = fields.Vector("position");
    node->last_update_ns = fields.Unsigned("last_update_time_ns", UINT64_MAX, 0);
    AddFlag("is_active", fields.Bool("is_active", false), node);
    node->is_predicted = fields.Bool("is_predicted", false);
    if (IsSemantic(node->type)) ReadSemantic(fields, node);
    switch (node->type) {
      case SparkClass::kKhronosObject:
        ReadObject(fields, node);
        return ReadKhronosObject(fields, node);
      case SparkClass::kObject:
        return ReadObject(fields, node);
      case SparkClass::kRoom:
        return ReadProbabilities(fields, node);
      case SparkClass::kPlace:
        return ReadPlace(fields, node);
      case SparkClass::kPlace2d:
        return ReadPlace2d(fields, node);
      case SparkClass::kAgent:
        return ReadAgent(fields, node);
      case SparkClass::kTraversability:
        return ReadTraversability(fields, node);
      case SparkClass::kNode:
      case SparkClass::kSemantic:
        return;
    }
  }

 private:
  void ReadSemantic(const JsonFields& fields, SparkNode* node) {
    node->name = fields.Text("name", "");
    ReadColor(fields, node);
    if (fields.Has("bounding_box")) ReadBox(fields.Object("bounding_box", true), &node->box);
    const uint64_t label = fields.Unsigned("semantic_label", UINT32_MAX, UINT32_MAX);
    if (label != UINT32_MAX) node->label = static_cast<uint32_t>(label);
    const Json* feature = fields.Find("semantic_feature");
    if (feature == nullptr || feature->is_null()) return;
    const size_t length = feature->is_object()
                              ? fields.Object("semantic_feature", true).Array("data").size()
                              : fields.Array("semantic_feature").size();
    AddLength("semantic_feature", length, node);
  }

  // {r, g, b, a}, or [r, g, b] before 1.0.3.
  void ReadColor(const JsonFields& fields, SparkNode* node) {
    const Json* color = fields.Find("color");
    if (color == nullptr || color->is_null()) return;
    node->color = Color{0, 0, 0, 255};
    if (!color->is_array()) {
      const JsonFields parts = fields.Object("color", true);
      constexpr const char* kNames[] = {"r", "g", "b", "a"};
      for (size_t i = 0; i < 4; ++i) {
        const auto fallback = i == 3 ? std::optional<uint64_t>(255) : std::nullopt;
        (*node->color)[i] = static_cast<uint8_t>(parts.Unsigned(kNames[i], 255, fallback));
      }
      return;
    }
    if (color->size() != 3 && color->size() != 4) {
      return fields.Fail("color", "has neither 3 nor 4 parts");
    }
    for (size_t i = 0; i < color->size(); ++i) {
      (*node->color)[i] = static_cast<uint8_t>(
          UnsignedOf((*color)[i], 255, absl::StrCat(fields.where(), ".color"), &source_));
    }
  }

  void ReadBox(const JsonFields& fields, SparkBox* box) {
    box->type = ReadBoxType(fields);
    if (box->type == SparkBox::Type::kInvalid) return;
    if (fields.Has("dimensions")) {
      box->dimensions = fields.Vector("dimensions").cast<float>();
    } else {
      const Eigen::Vector3f min = fields.Vector("min").cast<float>();
      box->dimensions = fields.Vector("max").cast<float>() - min;
    }
    box->center = fields.Vector("world_P_center").cast<float>();
    const Eigen::Quaternionf rotation = fields.Quaternion("world_R_center").cast<float>();
    // Not a number stays that, so that the box is refused where its rotation counts.
    if (rotation.norm() != 0.0f) box->rotation = rotation.normalized().toRotationMatrix();
  }

  static SparkBox::Type ReadBoxType(const JsonFields& fields) {
    const Json* type = fields.Find("type");
    if (type == nullptr || type->is_null()) return SparkBox::Type::kInvalid;
    if (type->is_number()) return static_cast<SparkBox::Type>(fields.Unsigned("type", 3));
    const std::string name = fields.Text("type");
    for (int i = 0; i < 4; ++i) {
      if (name == kSparkBoxNames[i]) return static_cast<SparkBox::Type>(i);
    }
    fields.Fail("type", absl::StrCat("\"", name.substr(0, 64), "\" is no type of box"));
    return SparkBox::Type::kInvalid;
  }

  void ReadObject(const JsonFields& fields, SparkNode* node) {
    CountList(fields, "mesh_connections", node);
    AddFlag("registered", fields.Bool("registered", false), node);
    node->orientation = fields.Quaternion("world_R_object");
  }

  void ReadKhronosObject(const JsonFields& fields, SparkNode* node) {
    ReadTimes(fields, "first_observed_ns", &node->first_observed_ns);
    ReadTimes(fields, "last_observed_ns", &node->last_observed_ns);
    CountList(fields, "trajectory_positions", node);
    CountList(fields, "trajectory_timestamps", node);
    CountList(fields, "dynamic_object_points", node);
    if (fields.Has("details")) {
      fields.Object("details", true);
      AddLength("details", fields.Find("details")->size(), node);
    }
    // Before 1.0.2 the mesh was three flat lists beside the other fields.
    const bool is_flat = !fields.Has("mesh");
    const JsonFields mesh = is_flat ? fields : fields.Object("mesh", true);
    const size_t per_item = is_flat ? 3 : 1;
    AddLength("mesh_vertices", mesh.Array(is_flat ? "vertices" : "points").size() / per_item, node);
    AddLength("mesh_faces", mesh.Array("faces").size() / per_item, node);
  }

  void ReadTimes(const JsonFields& fields, const char* name, std::vector<uint64_t>* times) {
    const std::string where = absl::StrCat(fields.where(), ".", name);
    for (const Json& time : fields.Array(name)) {
      times->push_back(UnsignedOf(time, UINT64_MAX, where, &source_));
    }
  }

  void ReadProbabilities(const JsonFields& fields, SparkNode* node) {
    const Json* values = fields.Find("semantic_class_probabilities");
    if (values == nullptr || values->is_null()) return;
    const JsonFields named = fields.Object("semantic_class_probabilities", true);
    if (!source_.ok()) return;
    for (const auto& [name, value] : values->items()) {
      node->class_probabilities[name] = named.Number(name.c_str());
    }
  }

  void ReadPlace(const JsonFields& fields, SparkNode* node) {
    node->distance = fields.Number("distance", 0.0);
    node->basis_point_count =
        static_cast<uint32_t>(fields.Unsigned("num_basis_points", UINT32_MAX, 0));
    AddPlaceLists(fields, node);
    AddFlag("real_place", fields.Bool("real_place", false), node);
    AddFlag("active_frontier", fields.Bool("active_frontier", false), node);
    if (fields.Has("frontier_scale")) AddScale(fields.Vector("frontier_scale"), node);
    node->orientation = fields.Quaternion("orientation");
    AddFlag("need_cleanup", fields.Bool("need_cleanup", false), node);
    AddNumber("num_frontier_voxels",
              static_cast<double>(fields.Unsigned("num_frontier_voxels", UINT64_MAX, 0)), node);
    AddFlag("anti_frontier", fields.Bool("anti_frontier", false), node);
  }

  void AddPlaceLists(const JsonFields& fields, SparkNode* node) {
    for (const char* name : {"voxblox_mesh_connections", "pcl_mesh_connections",
                             "mesh_vertex_labels", "deformation_connections"}) {
      CountList(fields, name, node);
    }
  }

  static void AddScale(const Eigen::Vector3d& scale, SparkNode* node) {
    AddNumber("frontier_scale_x", scale.x(), node);
    AddNumber("frontier_scale_y", scale.y(), node);
    AddNumber("frontier_scale_z", scale.z(), node);
  }

  // The ellipse_* fields are left out: files in the wild hold uninitialised memory there.
  void ReadPlace2d(const JsonFields& fields, SparkNode* node) {
    for (const Json& corner : fields.Array("boundary")) {
      node->boundary.push_back(
          VectorOf(corner, absl::StrCat(fields.where(), ".boundary"), &source_));
    }
    CountList(fields, "pcl_boundary_connections", node);
    AddPlaceLists(fields, node);
    AddFlag("need_cleanup_splitting", fields.Bool("need_cleanup_splitting", false), node);
    AddFlag("has_active_mesh_indices", fields.Bool("has_active_mesh_indices", false), node);
  }

  void ReadAgent(const JsonFields& fields, SparkNode* node) {
    if (fields.Has("timestamp")) node->stamp_ns = fields.Signed("timestamp");
    node->orientation = fields.Quaternion("world_R_body");
    const uint64_t key = fields.Unsigned("external_key", UINT64_MAX, node->id);
    if (key != node->id) node->attributes["external_key"] = absl::StrCat(key);
    CountList(fields, "dbow_ids", node);
    CountList(fields, "dbow_values", node);
  }

  void ReadTraversability(const JsonFields& fields, SparkNode* node) {
    node->first_observed_ns = {fields.Unsigned("first_observed_ns", UINT64_MAX, 0)};
    node->last_observed_ns = {fields.Unsigned("last_observed_ns", UINT64_MAX, 0)};
    node->distance = fields.Number("distance", 0.0);
    for (const char* name : {"min", "max"}) {
      const Json& corner = fields.Array(name);
      const std::string where = absl::StrCat(fields.where(), ".", name);
      if (corner.empty()) continue;
      if (corner.size() != 2) return fields.Fail(name, "does not have 2 numbers");
      AddNumber(absl::StrCat(name, "_x"), NumberOf(corner[0], where, &source_), node);
      AddNumber(absl::StrCat(name, "_y"), NumberOf(corner[1], where, &source_), node);
    }
    for (const char* name : {"states_0", "states_1", "states_2", "states_3"}) {
      CountList(fields, name, node);
    }
  }

  void CountList(const JsonFields& fields, const char* name, SparkNode* node) {
    AddLength(name, fields.Array(name).size(), node);
  }

  JsonSource& source_;
};

// "nodes[3].attributes.bounding_box.min" in "nodes[3].attributes": "bounding_box".
std::string FieldOf(const std::string& path, const std::string& where) {
  if (!path.starts_with(where)) return "";
  const std::string rest = path.substr(std::min(path.size(), where.size() + 1));
  return rest.substr(0, rest.find_first_of(".["));
}

}  // namespace

void ReadSparkAttributes(const JsonFields& attributes, JsonSource* source, SparkNode* node) {
  AttributesReader(source).ReadAttributes(attributes, node);
}

absl::Status ReadWhatCanBeRead(const std::string& file, const std::string& where, Json* attributes,
                               Skips* skips, SparkNode* node) {
  const SparkNode head = *node;
  for (;;) {
    JsonSource source{file, absl::OkStatus()};
    ReadSparkAttributes(JsonFields(*attributes, where, &source), &source, node);
    if (source.ok()) return absl::OkStatus();
    const std::string name = FieldOf(source.first_where, where);
    // Nothing stands where nobody knows; and what is not there cannot be taken out.
    if (name == "position" || !attributes->is_object() || attributes->erase(name) == 0) {
      return source.status;
    }
    skips->Add(SkipKind::kNodeField, source.first_where, source.first_what);
    *node = head;
  }
}

SparkClass ReadSparkClass(const std::string& where, const Json& attributes, Skips* skips) {
  const Json& type = Peek(attributes, "type");
  const auto known =
      type.is_string() ? SparkClassOf(type.get_ref<const std::string&>()) : std::nullopt;
  if (known.has_value()) return *known;
  skips->Add(SkipKind::kUnknownClass, absl::StrCat(where, ".type"),
             type.is_string() ? absl::StrCat("\"", type.get<std::string>().substr(0, 64),
                                             "\" is no known class of attributes")
                              : absl::StrCat("is ", type.is_null() ? "missing" : type.type_name(),
                                             "; expected the name of a class"));
  const bool is_semantic = Peek(attributes, "semantic_label").is_number();
  return is_semantic ? SparkClass::kSemantic : SparkClass::kNode;
}

}  // namespace dsg
