// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_fields.h"

#include <array>
#include <limits>
#include <map>
#include <utility>

#include "schema/interop/json_fields.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Type = SparkFieldType;

constexpr uint32_t kNoLabel = UINT32_MAX;

constexpr std::string_view kPosition = "position";
constexpr SparkField kNode[] = {{kPosition.data(), Type::kVector3},
                                {"last_update_time_ns", Type::kUnsigned64},
                                {"is_active", Type::kBool},
                                {"is_predicted", Type::kBool, {1, 0, 4}}};
constexpr SparkField kSemantic[] = {{"name", Type::kText},
                                    {"color", Type::kColor},
                                    {"bounding_box", Type::kBox},
                                    {"semantic_label", Type::kLabel},
                                    {"semantic_feature", Type::kFeature}};
constexpr SparkField kObject[] = {{"mesh_connections", Type::kList64},
                                  {"registered", Type::kBool},
                                  {"world_R_object", Type::kQuaternion}};
constexpr SparkField kKhronos[] = {{"first_observed_ns", Type::kList64},
                                   {"last_observed_ns", Type::kList64},
                                   {"trajectory_positions", Type::kFloatVectorList},
                                   {"trajectory_timestamps", Type::kList64},
                                   {"dynamic_object_points", Type::kCloudList},
                                   {"details", Type::kDetails},
                                   {"mesh", Type::kMesh}};
constexpr SparkField kRoom[] = {{"semantic_class_probabilities", Type::kProbabilities}};
constexpr SparkField kPlace[] = {{"distance", Type::kNumber},
                                 {"num_basis_points", Type::kUnsigned32},
                                 {"voxblox_mesh_connections", Type::kMeshLinks},
                                 {"pcl_mesh_connections", Type::kList64},
                                 {"mesh_vertex_labels", Type::kList8},
                                 {"deformation_connections", Type::kList64},
                                 {"real_place", Type::kBool},
                                 {"active_frontier", Type::kBool},
                                 {"frontier_scale", Type::kVector3},
                                 {"orientation", Type::kQuaternion},
                                 {"need_cleanup", Type::kBool},
                                 {"num_frontier_voxels", Type::kUnsigned64},
                                 {"anti_frontier", Type::kBool, {1, 1, 3}}};
constexpr SparkField kPlace2d[] = {{"boundary", Type::kVectorList},
                                   {"ellipse_centroid", Type::kVector3},
                                   {"ellipse_matrix_compress", Type::kMatrix2},
                                   {"ellipse_matrix_expand", Type::kMatrix2},
                                   {"pcl_boundary_connections", Type::kList64},
                                   {"voxblox_mesh_connections", Type::kMeshLinks},
                                   {"pcl_mesh_connections", Type::kList64},
                                   {"mesh_vertex_labels", Type::kList8},
                                   {"deformation_connections", Type::kList64},
                                   {"need_cleanup_splitting", Type::kBool},
                                   {"has_active_mesh_indices", Type::kBool}};
constexpr SparkField kAgent[] = {{"timestamp", Type::kTime, {1, 1, 0}},
                                 {"world_R_body", Type::kQuaternion},
                                 {"external_key", Type::kNodeId},
                                 {"dbow_ids", Type::kColumnUnsigned32},
                                 {"dbow_values", Type::kColumnFloat}};
constexpr SparkField kTraversability[] = {{"first_observed_ns", Type::kUnsigned64},
                                          {"last_observed_ns", Type::kUnsigned64},
                                          {"distance", Type::kNumber},
                                          {"min", Type::kVector2},
                                          {"max", Type::kVector2},
                                          {"states_0", Type::kList8},
                                          {"states_1", Type::kList8},
                                          {"states_2", Type::kList8},
                                          {"states_3", Type::kList8}};

template <size_t n>
void Append(const SparkField (&own)[n], std::vector<SparkField>* fields) {
  fields->insert(fields->end(), std::begin(own), std::end(own));
}

std::vector<SparkField> Collect(SparkClass type) {
  std::vector<SparkField> fields;
  Append(kNode, &fields);
  if (IsSemantic(type)) Append(kSemantic, &fields);
  switch (type) {
    case SparkClass::kKhronosObject:
      Append(kObject, &fields);
      Append(kKhronos, &fields);
      break;
    case SparkClass::kObject:
      Append(kObject, &fields);
      break;
    case SparkClass::kRoom:
      Append(kRoom, &fields);
      break;
    case SparkClass::kPlace:
      Append(kPlace, &fields);
      break;
    case SparkClass::kPlace2d:
      Append(kPlace2d, &fields);
      break;
    case SparkClass::kAgent:
      Append(kAgent, &fields);
      break;
    case SparkClass::kTraversability:
      Append(kTraversability, &fields);
      break;
    case SparkClass::kNode:
    case SparkClass::kSemantic:
      break;
  }
  return fields;
}

Json ColorJson(const Color& color) {
  return {{"r", color[0]}, {"g", color[1]}, {"b", color[2]}, {"a", color[3]}};
}

Json EmptyMesh() {
  return {{"has_colors", false},
          {"has_timestamps", false},
          {"has_labels", false},
          {"has_first_seen_stamps", false}};
}

Json EmptyBox() {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  return {{"type", "INVALID"},
          {"dimensions", VectorJson(zero)},
          {"world_P_center", VectorJson(zero)},
          {"world_R_center", QuaternionJson(Eigen::Quaterniond::Identity())}};
}

void UpgradeColor(Json* color) {
  if (color->is_object()) {
    if (!color->contains("a")) (*color)["a"] = 255;
    return;
  }
  Color parts = {0, 0, 0, 255};
  for (size_t i = 0; i < color->size() && i < 4; ++i) {
    parts[i] = static_cast<uint8_t>(PeekUnsigned(PeekAt(*color, i)));
  }
  *color = ColorJson(parts);
}

void UpgradeBox(Json* box) {
  if (!box->is_object()) {
    *box = EmptyBox();
    return;
  }
  const bool is_new = box->size() == 4 && Peek(*box, "type").is_string() &&
                      box->contains("dimensions") && box->contains("world_P_center") &&
                      box->contains("world_R_center");
  if (is_new) return;
  const Json type = Peek(*box, "type");
  if (type.is_number_unsigned() && type.get<size_t>() < std::size(kSparkBoxNames)) {
    (*box)["type"] = kSparkBoxNames[type.get<size_t>()];
  }
  if (type.is_null()) (*box)["type"] = kSparkBoxNames[0];
  const bool is_old = !box->contains("dimensions") && box->contains("min") && box->contains("max");
  if (is_old) {
    Json dimensions = Json::array();
    for (size_t i = 0; i < 3; ++i) {
      const auto max = static_cast<float>(PeekNumber(PeekAt((*box)["max"], i)));
      const auto min = static_cast<float>(PeekNumber(PeekAt((*box)["min"], i)));
      dimensions.push_back(static_cast<double>(max - min));
    }
    (*box)["dimensions"] = std::move(dimensions);
    box->erase("min");
    box->erase("max");
  }
  const Json empty = EmptyBox();
  for (const auto& [name, value] : empty.items()) {
    if (!box->contains(name)) (*box)[name] = value;
  }
}

// Before 1.0.2 a Khronos object's mesh was three flat lists beside the other fields.
void UpgradeKhronosMesh(Json* attributes) {
  if (attributes->contains("mesh")) return;
  Json mesh = EmptyMesh();
  const std::pair<const char*, const char*> lists[] = {
      {"vertices", "points"}, {"colors", "colors"}, {"faces", "faces"}};
  for (const auto& [old_name, name] : lists) {
    const auto found = attributes->find(old_name);
    if (found == attributes->end()) continue;
    const bool is_flat = found->is_array() && !found->empty() && !found->front().is_structured();
    if (is_flat && found->size() % 3 == 0) {
      Json triples = Json::array();
      for (size_t i = 0; i < found->size(); i += 3) {
        triples.push_back({(*found)[i], (*found)[i + 1], (*found)[i + 2]});
        if (old_name == std::string_view("colors")) triples.back().push_back(255);
      }
      mesh[name] = std::move(triples);
    }
    attributes->erase(found);
  }
  mesh["has_colors"] = mesh.contains("colors");
  (*attributes)["mesh"] = std::move(mesh);
}

bool HasFlag(const SparkNode& node, const char* name) {
  const auto* flag = FindAttribute<bool>(node.attributes, name);
  return flag != nullptr && *flag;
}

double NumberIn(const SparkNode& node, const std::string& name) {
  const auto* number = FindAttribute<double>(node.attributes, name);
  return number == nullptr ? 0.0 : *number;
}

Json BoxJson(const SparkBox& box) {
  const Eigen::Quaternionf rotation(box.rotation);
  return {{"type", kSparkBoxNames[static_cast<int>(box.type)]},
          {"dimensions", VectorJson(box.dimensions)},
          {"world_P_center", VectorJson(box.center)},
          {"world_R_center", QuaternionJson(rotation.cast<double>())}};
}

void MakeSemantic(const SparkNode& node, Json* out) {
  if (!node.name.empty()) (*out)["name"] = node.name;
  if (node.color.has_value()) (*out)["color"] = ColorJson(*node.color);
  if (node.box.type != SparkBox::Type::kInvalid) (*out)["bounding_box"] = BoxJson(node.box);
  if (node.label.has_value()) (*out)["semantic_label"] = *node.label;
}

void MakePlace(const SparkNode& node, Json* out) {
  (*out)["distance"] = node.distance;
  (*out)["num_basis_points"] = node.basis_point_count;
  const Eigen::Vector3d scale(NumberIn(node, "frontier_scale_x"),
                              NumberIn(node, "frontier_scale_y"),
                              NumberIn(node, "frontier_scale_z"));
  if (!scale.isZero(0.0)) (*out)["frontier_scale"] = VectorJson(scale);
  (*out)["orientation"] = QuaternionJson(node.orientation);
  const auto voxel_count = static_cast<uint64_t>(NumberIn(node, "num_frontier_voxels"));
  if (voxel_count != 0) (*out)["num_frontier_voxels"] = voxel_count;
}

void MakeTraversability(const SparkNode& node, Json* out) {
  const auto first = [](const std::vector<uint64_t>& times) {
    return times.empty() ? uint64_t{0} : times.front();
  };
  (*out)["first_observed_ns"] = first(node.first_observed_ns);
  (*out)["last_observed_ns"] = first(node.last_observed_ns);
  (*out)["distance"] = node.distance;
  for (const std::string corner : {"min", "max"}) {
    (*out)[corner] = {NumberIn(node, corner + "_x"), NumberIn(node, corner + "_y")};
  }
}

void MakeOwn(const SparkNode& node, Json* out) {
  switch (node.type) {
    case SparkClass::kKhronosObject:
      (*out)["first_observed_ns"] = node.first_observed_ns;
      (*out)["last_observed_ns"] = node.last_observed_ns;
      (*out)["world_R_object"] = QuaternionJson(node.orientation);
      return;
    case SparkClass::kObject:
      (*out)["world_R_object"] = QuaternionJson(node.orientation);
      return;
    case SparkClass::kRoom:
      (*out)["semantic_class_probabilities"] = Json::object();
      for (const auto& [name, probability] : node.class_probabilities) {
        (*out)["semantic_class_probabilities"][name] = probability;
      }
      return;
    case SparkClass::kPlace:
      return MakePlace(node, out);
    case SparkClass::kPlace2d:
      (*out)["boundary"] = Json::array();
      for (const Eigen::Vector3d& corner : node.boundary) {
        (*out)["boundary"].push_back(VectorJson(corner));
      }
      return;
    case SparkClass::kAgent:
      if (node.stamp_ns.has_value()) (*out)["timestamp"] = *node.stamp_ns;
      (*out)["world_R_body"] = QuaternionJson(node.orientation);
      return;
    case SparkClass::kTraversability:
      return MakeTraversability(node, out);
    case SparkClass::kNode:
    case SparkClass::kSemantic:
      return;
  }
}

}  // namespace

const std::vector<SparkField>& FieldsOf(SparkClass type) {
  static const auto* const all = [] {
    auto* fields = new std::map<SparkClass, std::vector<SparkField>>;
    for (int i = 0; i <= static_cast<int>(SparkClass::kTraversability); ++i) {
      (*fields)[static_cast<SparkClass>(i)] = Collect(static_cast<SparkClass>(i));
    }
    return fields;
  }();
  return all->at(type);
}

Json DefaultOf(SparkFieldType type, uint64_t node_id) {
  switch (type) {
    case Type::kVector3:
      return VectorJson(Eigen::Vector3d(Eigen::Vector3d::Zero()));
    case Type::kVector2:
      return {0.0, 0.0};
    case Type::kMatrix2:
      return {0.0, 0.0, 0.0, 0.0};
    case Type::kUnsigned64:
    case Type::kUnsigned32:
      return 0u;
    case Type::kNodeId:
      return node_id;
    case Type::kTime:
    case Type::kColumnUnsigned32:
    case Type::kColumnFloat:
      return nullptr;
    case Type::kLabel:
      return kNoLabel;
    case Type::kNumber:
      return 0.0;
    case Type::kBool:
      return false;
    case Type::kText:
      return "";
    case Type::kColor:
      return ColorJson(kSparkNoColor);
    case Type::kBox:
      return EmptyBox();
    case Type::kFeature:
      return {{"rows", 0}, {"cols", 0}, {"data", nullptr}};
    case Type::kQuaternion:
      return QuaternionJson(Eigen::Quaterniond::Identity());
    case Type::kList64:
    case Type::kList8:
    case Type::kVectorList:
    case Type::kFloatVectorList:
    case Type::kCloudList:
    case Type::kMeshLinks:
      return Json::array();
    case Type::kProbabilities:
    case Type::kDetails:
      return Json::object();
    case Type::kMesh:
      return EmptyMesh();
  }
  return nullptr;
}

namespace {

using Defaults = std::map<std::string, Json, std::less<>>;

// Sorted as the fields of a tree are.
const Defaults& DefaultsOf(SparkClass type) {
  static const auto* const all = [] {
    auto* made = new std::array<Defaults, static_cast<size_t>(SparkClass::kTraversability) + 1>;
    for (size_t i = 0; i < made->size(); ++i) {
      (*made)[i]["metadata"] = Json::object();
      for (const SparkField& field : FieldsOf(static_cast<SparkClass>(i))) {
        const bool is_fixed = field.type != Type::kNodeId && field.type != Type::kTime;
        if (is_fixed) (*made)[i][field.name] = DefaultOf(field.type, 0);
      }
    }
    return made;
  }();
  return (*all)[static_cast<size_t>(type)];
}

}  // namespace

const Json* DefaultFor(SparkClass type, const std::string& name) {
  const Defaults& defaults = DefaultsOf(type);
  const auto found = defaults.find(name);
  return found == defaults.end() ? nullptr : &found->second;
}

Json WithoutDefaults(SparkClass type, uint64_t node_id, Json fields) {
  if (!fields.is_object()) return fields;
  const Defaults& defaults = DefaultsOf(type);
  auto fallback = defaults.begin();
  for (auto it = fields.begin(); it != fields.end();) {
    const std::string& name = it.key();
    int order = -1;
    while (fallback != defaults.end() && (order = fallback->first.compare(name)) < 0) ++fallback;
    const bool has_fallback = fallback != defaults.end() && order == 0;
    const bool is_default = name == "type" || (has_fallback && *it == fallback->second) ||
                            (name == "external_key" && *it == Json(node_id));
    it = is_default ? fields.erase(it) : std::next(it);
  }
  return fields;
}

std::map<std::string, std::string, std::less<>> UsualTexts(SparkClass type) {
  std::map<std::string, std::string, std::less<>> texts = {{"metadata", "{}"}};
  for (const SparkField& field : FieldsOf(type)) {
    // A position must be there, and no colour is not black.
    const bool must_be_read = field.name == kPosition || field.type == Type::kColor ||
                              field.type == Type::kTime || field.type == Type::kNodeId;
    if (!must_be_read) texts[field.name] = DefaultOf(field.type, 0).dump();
  }
  return texts;
}

void UpgradeForms(SparkClass type, Json* attributes) {
  Json& metadata = (*attributes)["metadata"];
  if (metadata.is_null()) metadata = Json::object();
  if (type == SparkClass::kKhronosObject) UpgradeKhronosMesh(attributes);
  for (const SparkField& field : FieldsOf(type)) {
    const auto found = attributes->find(field.name);
    if (found == attributes->end()) continue;
    if (found->is_null()) {
      if (field.type != Type::kTime) attributes->erase(found);
      continue;
    }
    if (field.type == Type::kColor) UpgradeColor(&*found);
    if (field.type == Type::kBox) UpgradeBox(&*found);
    // A bare list once stood for a column.
    if (field.type == Type::kFeature && found->is_array()) {
      *found = {{"rows", found->size()}, {"cols", 1}, {"data", *found}};
    }
  }
}

void UpgradeFields(SparkClass type, uint64_t node_id, Json* attributes) {
  UpgradeForms(type, attributes);
  for (const SparkField& field : FieldsOf(type)) {
    const auto found = attributes->find(field.name);
    if (found != attributes->end() && !found->is_null()) continue;
    const Json fallback = DefaultOf(field.type, node_id);
    const bool is_absent = fallback.is_null() && field.type == Type::kTime;
    if (!is_absent) (*attributes)[field.name] = fallback;
  }
}

Json MakeFields(const SparkNode& node) {
  Json out = MakeSparseFields(node);
  out["type"] = NameOf(node.type);
  UpgradeFields(node.type, node.id, &out);
  return out;
}

Json MakeSparseFields(const SparkNode& node) {
  Json out = {{"position", VectorJson(node.position)}};
  if (node.last_update_ns != 0) out["last_update_time_ns"] = node.last_update_ns;
  if (node.is_predicted) out["is_predicted"] = true;
  if (IsSemantic(node.type)) MakeSemantic(node, &out);
  MakeOwn(node, &out);
  for (const SparkField& field : FieldsOf(node.type)) {
    if (field.type == Type::kBool && HasFlag(node, field.name)) out[field.name] = true;
  }
  const auto* key = FindAttribute<std::string>(node.attributes, "external_key");
  if (node.type == SparkClass::kAgent && key != nullptr) {
    const Json parsed = Json::parse(*key, nullptr, false);
    if (parsed.is_number_unsigned()) out["external_key"] = parsed;
  }
  const auto* metadata = FindAttribute<std::string>(node.attributes, "metadata");
  if (metadata != nullptr) out["metadata"] = Json::parse(*metadata, nullptr, false);
  if (out.contains("metadata") && out["metadata"].is_discarded()) out.erase("metadata");
  return out;
}

}  // namespace dsg
