// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_binary.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_error.h"
#include "schema/interop/json_document.h"
#include "schema/interop/spark_byte_reader.h"
#include "schema/interop/spark_metadata.h"

namespace dsg {
namespace {

constexpr uint64_t kUint32Max = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kUint64Max = std::numeric_limits<uint64_t>::max();
constexpr std::string_view kIdentifier = "SPARK_DSG";
constexpr SparkVersion kVersionOldest = {1, 0, 2};
constexpr size_t kTextBytesMax = size_t{1} << 20;
constexpr size_t kGraphTextBytesMax = size_t{64} << 20;

class SparkBinaryReader {
 public:
  SparkBinaryReader(std::string_view bytes, const std::string& file)
      : in_(bytes, file), file_(file) {}

  absl::StatusOr<SparkGraph> Read() {
    ReadHeader();
    if (in_.ok() && in_.NextIsBool()) {
      graph_.mesh = ReadMesh();
    } else {
      ReadGraph();
    }
    if (in_.left() > 0) in_.Fail("the file", "goes on after its end");
    DSG_RETURN_IF_ERROR(in_.status());
    return std::move(graph_);
  }

 private:
  bool Since(const SparkVersion& version) const { return graph_.version >= version; }

  void ReadHeader() {
    in_.Text("identifier", kIdentifier.size());
    in_.Text("project name", kTextBytesMax);
    graph_.version.major = static_cast<uint8_t>(in_.Unsigned("version", 255));
    graph_.version.minor = static_cast<uint8_t>(in_.Unsigned("version", 255));
    graph_.version.patch = static_cast<uint8_t>(in_.Unsigned("version", 255));
    if (graph_.version < kVersionOldest || graph_.version > kSparkVersionNewest) {
      in_.Fail("version",
               absl::StrCat("is ", ToString(graph_.version), "; binary files from ",
                            ToString(kVersionOldest), " to ", ToString(kSparkVersionNewest),
                            " are read. Save the graph as JSON instead"));
    }
  }

  void ReadGraph() {
    const size_t layer_count = in_.Array("layer keys", 2);
    for (size_t i = 0; i < layer_count && in_.ok(); ++i) ReadLayerKey();
    node_classes_ = ReadNames("node classes");
    edge_classes_ = ReadNames("edge classes");
    // Some files of 1.1.x lack the names; an array of texts cannot be mistaken for the text of the
    // metadata that follows.
    if (Since({1, 1, 0}) && in_.NextIsArrayOfArrays()) ReadLayerNames();
    if (Since({1, 0, 6})) {
      ReadGraphMetadata(ParseMetadata("graph metadata", kGraphTextBytesMax), &graph_);
    }
    // Before 1.1.0 the nodes with a time came in a list of their own.
    const int list_count = Since({1, 1, 0}) ? 1 : 2;
    for (int i = 0; i < list_count && in_.ok(); ++i) {
      in_.ListBegin("nodes");
      while (!in_.ListEnd()) ReadNode();
    }
    in_.ListBegin("edges");
    while (!in_.ListEnd()) ReadEdge();
    if (in_.Bool("mesh flag")) graph_.mesh = ReadMesh();
  }

  // A bare layer in files that predate partitions.
  SparkLayerKey ReadLayerKey() {
    if (in_.NextIsInteger()) return {in_.Signed("layer"), 0};
    in_.Marker("layer key", 2);
    const int64_t layer = in_.Signed("layer");
    return {layer, static_cast<uint32_t>(in_.Unsigned("partition", kUint32Max))};
  }

  std::vector<std::string> ReadNames(const char* field) {
    std::vector<std::string> names(in_.Array(field, 5));
    for (std::string& name : names) name = in_.Text(field, kTextBytesMax);
    return names;
  }

  void ReadLayerNames() {
    const size_t count = in_.Array("layer names", 7);
    for (size_t i = 0; i < count && in_.ok(); ++i) {
      const std::string name = in_.Text("layer name", kTextBytesMax);
      graph_.layer_names[name] = ReadLayerKey();
    }
  }

  nlohmann::json ParseMetadata(const char* field, size_t max) {
    const std::string text = in_.Text(field, max);
    if (text.empty() || text == "null" || text == "{}") return nullptr;
    auto parsed = ParseJson(text, file_);
    if (parsed.ok()) return *std::move(parsed);
    in_.Fail(field, absl::StrCat("is not JSON: ", parsed.status().message()));
    return nullptr;
  }

  void ReadNode() {
    SparkNode node;
    const size_t part_count = in_.Array("node", 1);
    node.key.layer = in_.Signed("layer");
    node.id = in_.Unsigned("node id", kUint64Max);
    const bool is_untimed = part_count == 3 && !Since({1, 1, 0});
    if (part_count != 4 && !is_untimed) in_.Fail("node", "should be an array of 4");
    if (Since({1, 1, 0})) {
      node.key.partition = static_cast<uint32_t>(in_.Unsigned("partition", kUint32Max));
    } else if (!is_untimed && !in_.TakeNil()) {
      node.stamp_ns = in_.Signed("node time");
      node.key.partition = static_cast<uint32_t>(node.id >> 56);
    }
    const auto type = SparkClassOf(ReadClass(node_classes_));
    if (!type.has_value()) in_.Fail("node class", "is none that the format has");
    if (!in_.ok()) return;
    node.type = *type;
    ReadAttributes(&node);
    if (in_.ok()) graph_.nodes.push_back(std::move(node));
  }

  std::string ReadClass(const std::vector<std::string>& names) {
    const uint64_t index = in_.Unsigned("class", 255);
    if (index < names.size()) return names[index];
    in_.Fail("class", absl::StrCat("is ", index, "; the file names ", names.size(), " classes"));
    return "";
  }

  std::string ReadMetadataText() {
    return Since({1, 0, 6}) ? MetadataText(ParseMetadata("metadata", kTextBytesMax)) : "";
  }

  void ReadAttributes(SparkNode* node) {
    std::string metadata = ReadMetadataText();
    if (!metadata.empty()) node->attributes["metadata"] = std::move(metadata);
    node->position = in_.Vector("position");
    node->last_update_ns = in_.Unsigned("last_update_time_ns", kUint64Max);
    AddFlag("is_active", in_.Bool("is_active"), node);
    if (Since({1, 0, 4})) node->is_predicted = in_.Bool("is_predicted");
    if (IsSemantic(node->type)) ReadSemantic(node);
    switch (node->type) {
      case SparkClass::kKhronosObject:
        ReadObject(node);
        return ReadKhronosObject(node);
      case SparkClass::kObject:
        return ReadObject(node);
      case SparkClass::kRoom:
        return ReadProbabilities(node);
      case SparkClass::kPlace:
        return ReadPlace(node);
      case SparkClass::kPlace2d:
        return ReadPlace2d(node);
      case SparkClass::kAgent:
        return ReadAgent(node);
      case SparkClass::kTraversability:
        return ReadTraversability(node);
      case SparkClass::kNode:
      case SparkClass::kSemantic:
        return;
    }
  }

  void ReadSemantic(SparkNode* node) {
    node->name = in_.Text("name", kTextBytesMax);
    const size_t channel_count = Since({1, 0, 3}) ? 4 : 3;
    node->color = Color{0, 0, 0, 255};
    for (size_t i = 0; i < channel_count; ++i) {
      (*node->color)[i] = static_cast<uint8_t>(in_.Unsigned("color", 255));
    }
    ReadBox(&node->box);
    const uint64_t label = in_.Unsigned("semantic_label", kUint32Max);
    if (label != kUint32Max) node->label = static_cast<uint32_t>(label);
    AddLength("semantic_feature", in_.SkipMatrix("semantic_feature"), node);
  }

  void ReadBox(SparkBox* out) {
    SparkBox box;
    in_.Marker("bounding_box", Since({1, 0, 3}) ? 4 : 5);
    box.type = static_cast<SparkBox::Type>(in_.Unsigned("bounding_box type", 3));
    const Eigen::Vector3f first = in_.Vector("bounding_box").cast<float>();
    box.dimensions =
        Since({1, 0, 3}) ? first : (in_.Vector("bounding_box").cast<float>() - first).eval();
    box.center = in_.Vector("bounding_box center").cast<float>();
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation;
    rotation.setIdentity();
    in_.Matrix("bounding_box rotation", rotation.data(), 3, 3);
    box.rotation = rotation.cast<float>();
    if (box.type != SparkBox::Type::kInvalid) *out = box;
  }

  void AddLength(const char* name, size_t length, SparkNode* node) {
    dsg::AddLength(name, length, &graph_, node);
  }

  void SkipList(const char* name, size_t scalars_per_element, SparkNode* node) {
    AddLength(name, in_.SkipScalars(name, scalars_per_element), node);
  }

  void ReadObject(SparkNode* node) {
    SkipList("mesh_connections", 1, node);
    AddFlag("registered", in_.Bool("registered"), node);
    node->orientation = in_.Quaternion("world_R_object");
  }

  void ReadKhronosObject(SparkNode* node) {
    node->first_observed_ns = ReadTimes("first_observed_ns");
    node->last_observed_ns = ReadTimes("last_observed_ns");
    SkipList("trajectory_positions", 3, node);
    SkipList("trajectory_timestamps", 1, node);
    const size_t cloud_count = in_.Array("dynamic_object_points", 5);
    for (size_t i = 0; i < cloud_count && in_.ok(); ++i) {
      in_.SkipScalars("dynamic_object_points", 3);
    }
    AddLength("dynamic_object_points", cloud_count, node);
    const size_t detail_count = in_.Array("details", 10);
    for (size_t i = 0; i < detail_count && in_.ok(); ++i) {
      in_.Text("details", kTextBytesMax);
      in_.SkipScalars("details", 1);
    }
    AddLength("details", detail_count, node);
    const MeshBlock mesh = ReadMesh();
    AddLength("mesh_vertices", mesh.positions_map.size(), node);
    AddLength("mesh_faces", mesh.faces.size(), node);
  }

  std::vector<uint64_t> ReadTimes(const char* field) {
    std::vector<uint64_t> times(in_.Array(field, 2));
    for (uint64_t& time : times) time = in_.Unsigned(field, kUint64Max);
    return times;
  }

  void ReadProbabilities(SparkNode* node) {
    const size_t count = in_.Array("semantic_class_probabilities", 10);
    for (size_t i = 0; i < count && in_.ok(); ++i) {
      const std::string name = in_.Text("semantic_class_probabilities", kTextBytesMax);
      node->class_probabilities[name] = in_.Number("semantic_class_probabilities");
    }
  }

  void SkipMeshLinks(SparkNode* node) {
    constexpr size_t kLinkBytesMin = 35;
    const size_t count = in_.Array("voxblox_mesh_connections", kLinkBytesMin);
    for (size_t i = 0; i < count && in_.ok(); ++i) {
      in_.Marker("voxblox_mesh_connections", 4);
      in_.SkipScalars("voxblox_mesh_connections block", 1);
      in_.SkipScalars("voxblox_mesh_connections voxel_pos", 1);
      in_.SkipScalar("voxblox_mesh_connections vertex");
      in_.SkipScalar("voxblox_mesh_connections label");
    }
    AddLength("voxblox_mesh_connections", count, node);
  }

  void SkipPlaceLists(SparkNode* node) {
    SkipMeshLinks(node);
    SkipList("pcl_mesh_connections", 1, node);
    SkipList("mesh_vertex_labels", 1, node);
    SkipList("deformation_connections", 1, node);
  }

  void ReadPlace(SparkNode* node) {
    node->distance = in_.Number("distance");
    node->basis_point_count = static_cast<uint32_t>(in_.Unsigned("num_basis_points", kUint32Max));
    SkipPlaceLists(node);
    AddFlag("real_place", in_.Bool("real_place"), node);
    bool active_frontier = in_.Bool("active_frontier");
    // Before is_predicted was a field of every node, places had one of their own in between.
    if (in_.NextIsBool() && !Since({1, 0, 4})) {
      node->is_predicted = active_frontier;
      active_frontier = in_.Bool("active_frontier");
    }
    AddFlag("active_frontier", active_frontier, node);
    const Eigen::Vector3d scale = in_.Vector("frontier_scale");
    AddNumber("frontier_scale_x", scale.x(), node);
    AddNumber("frontier_scale_y", scale.y(), node);
    AddNumber("frontier_scale_z", scale.z(), node);
    node->orientation = in_.Quaternion("orientation");
    AddFlag("need_cleanup", in_.Bool("need_cleanup"), node);
    AddNumber("num_frontier_voxels",
              static_cast<double>(in_.Unsigned("num_frontier_voxels", kUint64Max)), node);
    if (Since({1, 1, 3})) AddFlag("anti_frontier", in_.Bool("anti_frontier"), node);
  }

  // The ellipse_* fields are left out: files in the wild hold uninitialised memory there.
  void ReadPlace2d(SparkNode* node) {
    node->boundary.resize(in_.Array("boundary", 15));
    for (Eigen::Vector3d& corner : node->boundary) corner = in_.Vector("boundary");
    in_.Vector("ellipse_centroid");
    in_.SkipMatrix("ellipse_matrix_compress");
    in_.SkipMatrix("ellipse_matrix_expand");
    SkipList("pcl_boundary_connections", 1, node);
    SkipPlaceLists(node);
    AddFlag("need_cleanup_splitting", in_.Bool("need_cleanup_splitting"), node);
    AddFlag("has_active_mesh_indices", in_.Bool("has_active_mesh_indices"), node);
  }

  void ReadAgent(SparkNode* node) {
    if (Since({1, 1, 0})) node->stamp_ns = in_.Signed("timestamp");
    node->orientation = in_.Quaternion("world_R_body");
    const uint64_t key = in_.Unsigned("external_key", kUint64Max);
    if (key != node->id) node->attributes["external_key"] = absl::StrCat(key);
    AddLength("dbow_ids", in_.SkipMatrix("dbow_ids"), node);
    AddLength("dbow_values", in_.SkipMatrix("dbow_values"), node);
  }

  void ReadTraversability(SparkNode* node) {
    node->first_observed_ns = {in_.Unsigned("first_observed_ns", kUint64Max)};
    node->last_observed_ns = {in_.Unsigned("last_observed_ns", kUint64Max)};
    node->distance = in_.Number("distance");
    for (const char* name : {"min", "max"}) {
      double corner[2] = {0.0, 0.0};
      in_.Matrix(name, corner, 2, 1);
      AddNumber(absl::StrCat(name, "_x"), corner[0], node);
      AddNumber(absl::StrCat(name, "_y"), corner[1], node);
    }
    for (const char* name : {"states_0", "states_1", "states_2", "states_3"}) {
      SkipList(name, 1, node);
    }
  }

  void ReadEdge() {
    SparkEdge edge;
    in_.Marker("edge", 3);
    edge.source = in_.Unsigned("edge source", kUint64Max);
    edge.target = in_.Unsigned("edge target", kUint64Max);
    const std::string class_name = ReadClass(edge_classes_);
    if (class_name != "EdgeAttributes") in_.Fail("edge class", "is none that the format has");
    edge.metadata = ReadMetadataText();
    edge.weighted = in_.Bool("edge weighted");
    edge.weight = in_.Number("edge weight");
    if (in_.ok()) graph_.edges.push_back(std::move(edge));
  }

  MeshBlock ReadMesh() {
    // What the mesh was made to hold; the lists below say what it holds.
    for (const char* flag : {"has_colors", "has_timestamps", "has_labels", "has_first_seen"}) {
      in_.Bool(flag);
    }
    MeshBlock mesh;
    mesh.positions_map.resize(in_.Array("mesh points", 15));
    for (auto& point : mesh.positions_map) point = in_.Vector("mesh points").cast<float>();
    mesh.colors.resize(in_.Array("mesh colors", 8));
    for (uint32_t& color : mesh.colors) color = ReadMeshColor();
    mesh.last_seen_ns.resize(in_.Array("mesh stamps", 2));
    for (TimeNs& stamp : mesh.last_seen_ns) stamp = ReadMeshStamp();
    mesh.labels.resize(in_.Array("mesh labels", 2));
    for (uint32_t& label : mesh.labels) label = ReadMeshWord("mesh labels");
    mesh.first_seen_ns.resize(in_.Array("mesh first seen stamps", 2));
    for (TimeNs& stamp : mesh.first_seen_ns) stamp = ReadMeshStamp();
    mesh.faces.resize(in_.Array("mesh faces", 11));
    for (auto& face : mesh.faces) {
      in_.Marker("mesh faces", 3);
      for (uint32_t& vertex : face) vertex = ReadMeshWord("mesh faces");
    }
    return mesh;
  }

  uint32_t ReadMeshWord(const char* field) {
    return static_cast<uint32_t>(in_.Unsigned(field, kUint32Max));
  }

  TimeNs ReadMeshStamp() { return StampOrZero(in_.Unsigned("mesh stamps", kUint64Max)); }

  uint32_t ReadMeshColor() {
    uint32_t rgb = 0;
    for (int i = 0; i < 3; ++i) {
      rgb = rgb << 8 | static_cast<uint32_t>(in_.Unsigned("mesh colors", 255));
    }
    in_.Unsigned("mesh colors", 255);
    return rgb;
  }

  SparkByteReader in_;
  std::string file_;
  SparkGraph graph_;
  std::vector<std::string> node_classes_;
  std::vector<std::string> edge_classes_;
};

}  // namespace

bool LooksLikeSparkBinary(std::string_view bytes) {
  return !bytes.empty() && (bytes[0] == '\xdd' || bytes[0] == '\xdb');
}

absl::StatusOr<SparkGraph> ReadSparkBinary(std::string_view bytes, const std::string& file) {
  constexpr size_t kCountBytes = 5;
  if (bytes.size() >= kCountBytes + kIdentifier.size() &&
      bytes.substr(kCountBytes, kIdentifier.size()) != kIdentifier) {
    return FileError(file, "byte 0",
                     "does not begin with \"SPARK_DSG\"; binary files from before version 1.0.2 "
                     "are not read, load the file with its own program and save it as JSON");
  }
  return SparkBinaryReader(bytes, file).Read();
}

}  // namespace dsg
