// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/interop/spark_binary_writer.h"

#include <bit>
#include <set>

namespace dsg {
namespace {

// In the order in which the writer numbers them, which differs from the reader's own on purpose.
constexpr SparkClass kClasses[] = {
    SparkClass::kAgent,  SparkClass::kKhronosObject, SparkClass::kNode,
    SparkClass::kObject, SparkClass::kPlace2d,       SparkClass::kPlace,
    SparkClass::kRoom,   SparkClass::kSemantic,      SparkClass::kTraversability};

class Writer {
 public:
  explicit Writer(SparkVersion version) : version_(version) {}

  std::string Take() && { return std::move(out_); }

  void Header() {
    Text("SPARK_DSG");
    Text("main");
    U8(version_.major);
    U8(version_.minor);
    U8(version_.patch);
  }

  void Graph(const SparkGraph& graph) {
    LayerKeys(graph);
    Array(std::size(kClasses));
    for (const SparkClass type : kClasses) Text(std::string(NameOf(type)));
    Array(1);
    Text("EdgeAttributes");
    if (Since({1, 1, 1})) LayerNames(graph);
    if (Since({1, 0, 6})) Text(GraphMetadata(graph));
    Nodes(graph);
    Byte(0x00);
    for (const SparkEdge& edge : graph.edges) EdgeRecord(edge);
    Byte(0x01);
    Bool(graph.mesh.has_value());
    if (graph.mesh.has_value()) Mesh(*graph.mesh);
  }

  void Mesh(const MeshBlock& mesh) {
    Bool(!mesh.colors.empty());
    Bool(!mesh.last_seen_ns.empty());
    Bool(!mesh.labels.empty());
    Bool(!mesh.first_seen_ns.empty());
    Array(mesh.positions_map.size());
    for (const auto& point : mesh.positions_map) Vector(point);
    Array(mesh.colors.size());
    for (const uint32_t rgb : mesh.colors) {
      for (const int shift : {16, 8, 0}) U8(static_cast<uint8_t>(rgb >> shift));
      U8(255);
    }
    Times(mesh.last_seen_ns);
    Array(mesh.labels.size());
    for (const uint32_t label : mesh.labels) U32(label);
    Times(mesh.first_seen_ns);
    Array(mesh.faces.size());
    for (const auto& face : mesh.faces) {
      Array(3);
      for (const uint32_t vertex : face) U64(vertex);
    }
  }

 private:
  bool Since(SparkVersion version) const { return version_ >= version; }

  void Byte(uint8_t byte) { out_.push_back(static_cast<char>(byte)); }
  void Word(uint64_t word, int width) {
    for (int i = 0; i < width; ++i) Byte(static_cast<uint8_t>(word >> (8 * i)));
  }
  void Tagged(uint8_t tag, uint64_t word, int width) {
    Byte(tag);
    Word(word, width);
  }
  void Nil() { Byte(0xc0); }
  void Bool(bool value) { Byte(value ? 0xc3 : 0xc2); }
  void U8(uint8_t value) { Tagged(0xcc, value, 1); }
  void U32(uint32_t value) { Tagged(0xce, value, 4); }
  void U64(uint64_t value) { Tagged(0xcf, value, 8); }
  void I32(int32_t value) { Tagged(0xd2, static_cast<uint32_t>(value), 4); }
  void I64(int64_t value) { Tagged(0xd3, static_cast<uint64_t>(value), 8); }
  void Number(float value) { Tagged(0xca, std::bit_cast<uint32_t>(value), 4); }
  void Number(double value) { Tagged(0xcb, std::bit_cast<uint64_t>(value), 8); }
  void Array(size_t count) { Tagged(0xdd, count, 4); }
  void Text(const std::string& text) {
    Array(text.size());
    out_ += text;
  }
  template <typename V>
  void Vector(const V& vector) {
    for (int i = 0; i < 3; ++i) Number(vector[i]);
  }
  void Quaternion(const Eigen::Quaterniond& q) {
    Array(4);
    for (const double part : {q.w(), q.x(), q.y(), q.z()}) Number(part);
  }
  template <typename T>
  void Times(const std::vector<T>& times) {
    Array(times.size());
    for (const T time : times) U64(static_cast<uint64_t>(time));
  }

  static size_t Length(const SparkNode& node, const char* name) {
    const auto found = node.attributes.find(name);
    return found == node.attributes.end() ? 0
                                          : static_cast<size_t>(std::get<double>(found->second));
  }
  static double NumberOf(const SparkNode& node, const char* name) {
    const auto found = node.attributes.find(name);
    return found == node.attributes.end() ? 0.0 : std::get<double>(found->second);
  }
  static bool Flag(const SparkNode& node, const char* name) {
    return node.attributes.contains(name);
  }

  void ZerosU64(const SparkNode& node, const char* name) {
    Array(Length(node, name));
    for (size_t i = 0; i < Length(node, name); ++i) U64(0);
  }
  void ZerosU8(const SparkNode& node, const char* name) {
    Array(Length(node, name));
    for (size_t i = 0; i < Length(node, name); ++i) U8(0);
  }
  void ColumnF32(const SparkNode& node, const char* name) {
    const size_t length = Length(node, name);
    Array(length + 2);
    I64(static_cast<int64_t>(length));
    I64(length > 0 ? 1 : 0);
    for (size_t i = 0; i < length; ++i) Number(0.5f);
  }

  void LayerKeys(const SparkGraph& graph) {
    std::set<SparkLayerKey> keys;
    for (const SparkNode& node : graph.nodes) keys.insert(node.key);
    Array(keys.size());
    for (const SparkLayerKey& key : keys) {
      if (Since({1, 1, 2})) LayerKey(key);
      if (!Since({1, 1, 2})) I64(key.layer);
    }
  }
  void LayerKey(const SparkLayerKey& key) {
    Array(2);
    I64(key.layer);
    U32(key.partition);
  }
  void LayerNames(const SparkGraph& graph) {
    Array(graph.layer_names.size());
    for (const auto& [name, key] : graph.layer_names) {
      Text(name);
      LayerKey(key);
    }
  }

  static std::string GraphMetadata(const SparkGraph& graph) {
    if (graph.label_spaces.empty()) return "{}";
    std::string text;
    for (const auto& [key, labels] : graph.label_spaces) {
      text += (text.empty() ? "\"_l" : ",\"_l") + std::to_string(key.layer) + "p" +
              std::to_string(key.partition) + "\":[";
      for (size_t i = 0; i < labels.size(); ++i) {
        text +=
            (i > 0 ? ",[" : "[") + std::to_string(labels[i].id) + ",\"" + labels[i].name + "\"]";
      }
      text += "]";
    }
    return "{\"labelspaces\":{" + text + "}}";
  }

  void Nodes(const SparkGraph& graph) {
    Byte(0x00);
    for (const SparkNode& node : graph.nodes) {
      if (Since({1, 1, 0}) || !node.stamp_ns.has_value()) NodeRecord(node);
    }
    Byte(0x01);
    if (Since({1, 1, 0})) return;
    Byte(0x00);
    for (const SparkNode& node : graph.nodes) {
      if (node.stamp_ns.has_value()) NodeRecord(node);
    }
    Byte(0x01);
  }

  void NodeRecord(const SparkNode& node) {
    Array(4);
    I64(node.key.layer);
    U64(node.id);
    if (Since({1, 1, 0})) {
      U32(node.key.partition);
    } else if (node.stamp_ns.has_value()) {
      I64(*node.stamp_ns);
    } else {
      Nil();
    }
    for (uint8_t i = 0; i < std::size(kClasses); ++i) {
      if (kClasses[i] == node.type) U8(i);
    }
    if (Since({1, 0, 6})) {
      const auto metadata = node.attributes.find("metadata");
      Text(metadata == node.attributes.end() ? "{}" : std::get<std::string>(metadata->second));
    }
    Vector(node.position);
    U64(node.last_update_ns);
    Bool(Flag(node, "is_active"));
    if (Since({1, 0, 4})) Bool(node.is_predicted);
    if (IsSemantic(node.type)) Semantic(node);
    Rest(node);
  }

  void Semantic(const SparkNode& node) {
    Text(node.name);
    const Color color = node.color.value_or(Color{0, 0, 0, 255});
    for (size_t i = 0; i < (Since({1, 0, 3}) ? 4u : 3u); ++i) U8(color[i]);
    Box(node.box);
    U32(node.label.value_or(0xFFFFFFFFu));
    ColumnF32(node, "semantic_feature");
  }

  void Box(const SparkBox& box) {
    Array(Since({1, 0, 3}) ? 4 : 5);
    I32(static_cast<int32_t>(box.type));
    if (Since({1, 0, 3})) {
      Vector(box.dimensions);
    } else {
      Vector(Eigen::Vector3f(-0.5f * box.dimensions));
      Vector(Eigen::Vector3f(0.5f * box.dimensions));
    }
    Vector(box.center);
    Array(11);
    I64(3);
    I64(3);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) Number(box.rotation(r, c));
    }
  }

  void Rest(const SparkNode& node) {
    switch (node.type) {
      case SparkClass::kKhronosObject:
        Object(node);
        return Khronos(node);
      case SparkClass::kObject:
        return Object(node);
      case SparkClass::kRoom:
        return Probabilities(node);
      case SparkClass::kPlace:
        return Place(node);
      case SparkClass::kPlace2d:
        return Place2d(node);
      case SparkClass::kAgent:
        return Agent(node);
      case SparkClass::kTraversability:
        return Traversability(node);
      case SparkClass::kNode:
      case SparkClass::kSemantic:
        return;
    }
  }

  void Object(const SparkNode& node) {
    ZerosU64(node, "mesh_connections");
    Bool(Flag(node, "registered"));
    Quaternion(node.orientation);
  }

  void Khronos(const SparkNode& node) {
    Times(node.first_observed_ns);
    Times(node.last_observed_ns);
    Array(Length(node, "trajectory_positions"));
    for (size_t i = 0; i < Length(node, "trajectory_positions"); ++i) {
      Vector(Eigen::Vector3f(0.f, 1.f, 2.f));
    }
    ZerosU64(node, "trajectory_timestamps");
    Array(Length(node, "dynamic_object_points"));
    for (size_t i = 0; i < Length(node, "dynamic_object_points"); ++i) {
      Array(1);
      Vector(Eigen::Vector3f(3.f, 4.f, 5.f));
    }
    Array(Length(node, "details"));
    for (size_t i = 0; i < Length(node, "details"); ++i) {
      Text("key" + std::to_string(i));
      Array(1);
      U64(i);
    }
    MeshBlock mesh;
    mesh.positions_map.resize(Length(node, "mesh_vertices"), Eigen::Vector3f::Zero());
    mesh.faces.resize(Length(node, "mesh_faces"), {0, 0, 0});
    Mesh(mesh);
  }

  void Probabilities(const SparkNode& node) {
    Array(node.class_probabilities.size());
    for (const auto& [name, probability] : node.class_probabilities) {
      Text(name);
      Number(probability);
    }
  }

  void PlaceLists(const SparkNode& node) {
    const size_t links = Length(node, "voxblox_mesh_connections");
    Array(links);
    for (size_t i = 0; i < links; ++i) {
      Array(4);
      Array(3);
      for (int k = 0; k < 3; ++k) I32(-k);
      Array(3);
      for (int k = 0; k < 3; ++k) Number(0.25 * k);
      U64(i);
      if (i % 2 == 0) Nil();
      if (i % 2 == 1) U32(7);
    }
    ZerosU64(node, "pcl_mesh_connections");
    ZerosU8(node, "mesh_vertex_labels");
    ZerosU64(node, "deformation_connections");
  }

  void Place(const SparkNode& node) {
    Number(node.distance);
    U32(node.basis_point_count);
    PlaceLists(node);
    Bool(Flag(node, "real_place"));
    if (!Since({1, 0, 4})) Bool(node.is_predicted);
    Bool(Flag(node, "active_frontier"));
    for (const char* axis : {"frontier_scale_x", "frontier_scale_y", "frontier_scale_z"}) {
      Number(NumberOf(node, axis));
    }
    Quaternion(node.orientation);
    Bool(Flag(node, "need_cleanup"));
    U64(static_cast<uint64_t>(NumberOf(node, "num_frontier_voxels")));
    if (Since({1, 1, 3})) Bool(Flag(node, "anti_frontier"));
  }

  void Place2d(const SparkNode& node) {
    Array(node.boundary.size());
    for (const Eigen::Vector3d& corner : node.boundary) Vector(corner);
    Vector(Eigen::Vector3d(2.46e-154, 7.36e271, 0.0));
    for (int matrix = 0; matrix < 2; ++matrix) {
      Array(6);
      I64(2);
      I64(2);
      for (int i = 0; i < 4; ++i) Number(1e243);
    }
    ZerosU64(node, "pcl_boundary_connections");
    PlaceLists(node);
    Bool(Flag(node, "need_cleanup_splitting"));
    Bool(Flag(node, "has_active_mesh_indices"));
  }

  void Agent(const SparkNode& node) {
    if (Since({1, 1, 0})) I64(node.stamp_ns.value_or(0));
    Quaternion(node.orientation);
    const auto key = node.attributes.find("external_key");
    U64(key == node.attributes.end() ? node.id : std::stoull(std::get<std::string>(key->second)));
    const size_t ids = Length(node, "dbow_ids");
    Array(ids + 2);
    I64(static_cast<int64_t>(ids));
    I64(1);
    for (size_t i = 0; i < ids; ++i) U32(9);
    ColumnF32(node, "dbow_values");
  }

  void Traversability(const SparkNode& node) {
    U64(node.first_observed_ns.empty() ? 0 : node.first_observed_ns[0]);
    U64(node.last_observed_ns.empty() ? 0 : node.last_observed_ns[0]);
    Number(node.distance);
    for (const std::string corner : {"min", "max"}) {
      Array(4);
      I64(2);
      I64(1);
      Number(NumberOf(node, (corner + "_x").c_str()));
      Number(NumberOf(node, (corner + "_y").c_str()));
    }
    for (const char* name : {"states_0", "states_1", "states_2", "states_3"}) ZerosU8(node, name);
  }

  void EdgeRecord(const SparkEdge& edge) {
    Array(3);
    U64(edge.source);
    U64(edge.target);
    U8(0);
    if (Since({1, 0, 6})) Text(edge.metadata.empty() ? "null" : edge.metadata);
    Bool(edge.weighted);
    Number(edge.weight);
  }

  SparkVersion version_;
  std::string out_;
};

}  // namespace

std::string WriteSparkBinary(const SparkGraph& graph, SparkVersion version) {
  Writer writer(version);
  writer.Header();
  writer.Graph(graph);
  return std::move(writer).Take();
}

std::string WriteSparkMeshFile(const MeshBlock& mesh, SparkVersion version) {
  Writer writer(version);
  writer.Header();
  writer.Mesh(mesh);
  return std::move(writer).Take();
}

}  // namespace dsg
