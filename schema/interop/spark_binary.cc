// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_binary.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_errors.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_bytes.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_mesh.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Type = SparkFieldType;

constexpr std::string_view kIdentifier = "SPARK_DSG";
constexpr SparkVersion kVersionOldest = {1, 0, 2};
constexpr SparkVersion kNewColorsAndBoxes = {1, 0, 3};
constexpr size_t kTextBytesMax = size_t{1} << 20;
constexpr size_t kGraphTextBytesMax = size_t{64} << 20;

uint32_t MeshWord(const char* field, SparkByteReader* in) {
  return static_cast<uint32_t>(in->Unsigned(field, UINT32_MAX));
}

uint32_t MeshColor(SparkByteReader* in) {
  uint32_t rgb = 0;
  for (int i = 0; i < 3; ++i) {
    rgb = rgb << 8 | static_cast<uint32_t>(in->Unsigned("mesh colors", 255));
  }
  in->Unsigned("mesh colors", 255);
  return rgb;
}

// A mesh without a header.
MeshBlock ReadBinaryMesh(SparkByteReader* in) {
  // What the mesh was made to hold; the lists below say what it holds.
  for (const char* flag : {"has_colors", "has_timestamps", "has_labels", "has_first_seen"}) {
    in->Bool(flag);
  }
  const auto stamp = [in] { return StampOrZero(in->Unsigned("mesh stamps", UINT64_MAX)); };
  MeshBlock mesh;
  mesh.positions_map.resize(in->Array("mesh points", 15));
  for (auto& point : mesh.positions_map) point = in->Vector("mesh points").cast<float>();
  mesh.colors.resize(in->Array("mesh colors", 8));
  for (uint32_t& color : mesh.colors) color = MeshColor(in);
  mesh.last_seen_ns.resize(in->Array("mesh stamps", 2));
  for (TimeNs& time : mesh.last_seen_ns) time = stamp();
  mesh.labels.resize(in->Array("mesh labels", 2));
  for (uint32_t& label : mesh.labels) label = MeshWord("mesh labels", in);
  mesh.first_seen_ns.resize(in->Array("mesh first seen stamps", 2));
  for (TimeNs& time : mesh.first_seen_ns) time = stamp();
  mesh.faces.resize(in->Array("mesh faces", 11));
  for (auto& face : mesh.faces) {
    in->Marker("mesh faces", 3);
    for (uint32_t& vertex : face) vertex = MeshWord("mesh faces", in);
  }
  return mesh;
}

// Fields of one node, as the JSON that the format has for them.
class FieldsReader {
 public:
  FieldsReader(const SparkVersion& version, SparkByteReader* in) : version_(version), in_(*in) {}

  Json Read(const SparkField& field) {
    const char* name = field.name;
    switch (field.type) {
      case Type::kVector3:
        return VectorJson(in_.Vector(name));
      case Type::kVector2:
        return Matrix(name, 2, 1);
      case Type::kMatrix2:
        return Matrix(name, 2, 2);
      case Type::kUnsigned64:
      case Type::kNodeId:
        return in_.Unsigned(name, UINT64_MAX);
      case Type::kUnsigned32:
      case Type::kLabel:
        return in_.Unsigned(name, UINT32_MAX);
      case Type::kTime:
        return in_.Signed(name);
      case Type::kNumber:
        return in_.Number(name);
      case Type::kBool:
        return in_.Bool(name);
      case Type::kText:
        return in_.Text(name, kTextBytesMax);
      case Type::kColor:
        return Color(name);
      case Type::kBox:
        return Box(name);
      case Type::kQuaternion:
        return QuaternionJson(in_.Quaternion(name));
      default:
        return ReadLong(field);
    }
  }

 private:
  // What may have many values.
  Json ReadLong(const SparkField& field) {
    const char* name = field.name;
    switch (field.type) {
      case Type::kFeature:
        return Feature(name);
      case Type::kColumnUnsigned32:
      case Type::kColumnFloat:
        return Column(name, field.type == Type::kColumnFloat);
      case Type::kList64:
        return Integers(name, UINT64_MAX);
      case Type::kList8:
        return Integers(name, 255);
      case Type::kVectorList:
      case Type::kFloatVectorList:
        return Vectors(name);
      case Type::kCloudList:
        return Each(name, 5, [this, name] { return Vectors(name); });
      case Type::kMeshLinks:
        return Each(name, kLinkBytesMin, [this, name] { return MeshLink(name); });
      case Type::kProbabilities:
        return Named(name, [this, name] { return Json(in_.Number(name)); });
      case Type::kDetails:
        return Named(name, [this, name] { return Integers(name, UINT64_MAX); });
      case Type::kMesh:
        return SparkMeshToJson(ReadBinaryMesh(&in_));
      default:
        return nullptr;
    }
  }

  static constexpr size_t kLinkBytesMin = 35;

  Json Matrix(const char* name, size_t rows, size_t columns) {
    double values[4] = {};
    in_.Matrix(name, values, rows, columns);
    return Json(std::vector<double>(values, values + rows * columns));
  }

  Json Color(const char* name) {
    const auto part = [&] { return in_.Unsigned(name, 255); };
    Json color = {{"r", part()}};
    color["g"] = part();
    color["b"] = part();
    color["a"] = version_ >= kNewColorsAndBoxes ? part() : 255;
    return color;
  }

  Json Box(const char* name) {
    const bool is_new = version_ >= kNewColorsAndBoxes;
    in_.Marker(name, is_new ? 4 : 5);
    const uint64_t type = in_.Unsigned("bounding_box type", 3);
    const Eigen::Vector3f first = in_.Vector(name).cast<float>();
    const Eigen::Vector3f dimensions = is_new ? first : in_.Vector(name).cast<float>() - first;
    const Eigen::Vector3d center = in_.Vector("bounding_box center");
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation;
    rotation.setIdentity();
    in_.Matrix("bounding_box rotation", rotation.data(), 3, 3);
    if (type == 0) return DefaultOf(Type::kBox, 0);
    return {{"type", type},
            {"dimensions", VectorJson(dimensions.cast<double>())},
            {"world_P_center", VectorJson(center)},
            {"world_R_center", QuaternionJson(Eigen::Quaterniond(Eigen::Matrix3d(rotation)))}};
  }

  // True while values may still be added: a tree takes more memory than the file it comes from.
  bool CountValue(const char* name) {
    if (++value_count_ > kJsonValueCountMax) {
      in_.Fail(name, absl::StrCat("is the end of ", kJsonValueCountMax, " values of one node"));
    }
    return in_.ok();
  }

  template <typename ReadOne>
  Json Each(const char* name, size_t element_bytes, const ReadOne& read) {
    Json list = Json::array();
    const size_t count = in_.Array(name, element_bytes);
    for (size_t i = 0; i < count && CountValue(name); ++i) list.push_back(read());
    return list;
  }

  template <typename ReadOne>
  Json Named(const char* name, const ReadOne& read) {
    Json values = Json::object();
    const size_t count = in_.Array(name, 10);
    for (size_t i = 0; i < count && CountValue(name); ++i) {
      const std::string key = in_.Text(name, kTextBytesMax);
      values[key] = read();
    }
    return values;
  }

  Json Integers(const char* name, uint64_t max) {
    return Each(name, 2, [&] { return in_.Unsigned(name, max); });
  }

  Json Vectors(const char* name) {
    return Each(name, 15, [&] { return VectorJson(in_.Vector(name)); });
  }

  struct Size {
    uint64_t rows = 0;
    uint64_t columns = 0;
  };

  Size MatrixSize(const char* name) {
    const size_t size = in_.Array(name, 2);
    if (size < 2) in_.Fail(name, "should be a matrix and has no rows and columns");
    if (!in_.ok()) return {};
    const uint64_t rows = in_.Unsigned(name, size);
    const uint64_t columns = in_.Unsigned(name, UINT32_MAX);
    if (rows * columns + 2 != size) in_.Fail(name, "has not as many values as rows times columns");
    return in_.ok() ? Size{rows, columns} : Size{};
  }

  Json Feature(const char* name) {
    const Size size = MatrixSize(name);
    Json data = Json::array();
    for (size_t i = 0; i < size.rows * size.columns && CountValue(name); ++i) {
      data.push_back(in_.Number(name));
    }
    if (data.empty()) data = nullptr;
    return {{"rows", size.rows}, {"cols", size.columns}, {"data", std::move(data)}};
  }

  Json Column(const char* name, bool is_float) {
    const Size size = MatrixSize(name);
    Json data = Json::array();
    for (size_t i = 0; i < size.rows * size.columns && CountValue(name); ++i) {
      if (is_float) data.push_back(in_.Number(name));
      if (!is_float) data.push_back(in_.Unsigned(name, UINT32_MAX));
    }
    if (data.empty()) return nullptr;
    return data;
  }

  Json MeshLink(const char* name) {
    in_.Marker(name, 4);
    Json link;
    in_.Marker("voxblox_mesh_connections block", 3);
    for (int i = 0; i < 3; ++i) {
      link["block"].push_back(in_.Signed("voxblox_mesh_connections block"));
    }
    in_.Marker("voxblox_mesh_connections voxel_pos", 3);
    link["voxel_pos"] = VectorJson(in_.Vector("voxblox_mesh_connections voxel_pos"));
    link["vertex"] = in_.Unsigned("voxblox_mesh_connections vertex", UINT64_MAX);
    link["label"] = nullptr;
    if (!in_.TakeNil()) link["label"] = in_.Unsigned("voxblox_mesh_connections label", UINT32_MAX);
    return link;
  }

  const SparkVersion& version_;
  SparkByteReader& in_;
  size_t value_count_ = 0;
};

// The fields of a class in the order of `version`, without "type" and "metadata". After an error of
// `in` the result is worthless.
Json ReadBinaryFields(SparkClass type, const SparkVersion& version, SparkByteReader* in) {
  FieldsReader reader(version, in);
  Json out = Json::object();
  const bool is_old_place = type == SparkClass::kPlace && version < SparkVersion{1, 0, 4};
  for (const SparkField& field : FieldsOf(type)) {
    if (version < field.since) continue;
    out[field.name] = reader.Read(field);
    // Before is_predicted was a field of every node, places had one of their own in between.
    if (is_old_place && field.name == std::string_view("active_frontier") && in->NextIsBool()) {
      out["is_predicted"] = out["active_frontier"];
      out["active_frontier"] = in->Bool("active_frontier");
    }
    if (!in->ok()) break;
  }
  return out;
}

class SparkBinaryReader {
 public:
  SparkBinaryReader(std::string_view bytes, const std::string& file)
      : in_(bytes, file), file_(file) {}

  absl::StatusOr<SparkGraph> Read() {
    ReadHeader();
    if (in_.ok() && in_.NextIsBool()) {
      graph_.mesh = ReadBinaryMesh(&in_);
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
    for (size_t i = 0; i < layer_count && in_.ok(); ++i)
      graph_.layer_keys.push_back(ReadLayerKey());
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
    if (in_.Bool("mesh flag")) graph_.mesh = ReadBinaryMesh(&in_);
  }

  // A bare layer in files that predate partitions.
  SparkLayerKey ReadLayerKey() {
    if (in_.NextIsInteger()) return {in_.Signed("layer"), 0};
    in_.Marker("layer key", 2);
    const int64_t layer = in_.Signed("layer");
    return {layer, static_cast<uint32_t>(in_.Unsigned("partition", UINT32_MAX))};
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

  Json ParseMetadata(const char* field, size_t max) {
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
    node.id = in_.Unsigned("node id", UINT64_MAX);
    const bool is_untimed = part_count == 3 && !Since({1, 1, 0});
    if (part_count != 4 && !is_untimed) in_.Fail("node", "should be an array of 4");
    if (Since({1, 1, 0})) {
      node.key.partition = static_cast<uint32_t>(in_.Unsigned("partition", UINT32_MAX));
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

  void ReadAttributes(SparkNode* node) {
    Json metadata;
    if (Since({1, 0, 6})) metadata = ParseMetadata("metadata", kTextBytesMax);
    Json fields = ReadBinaryFields(node->type, graph_.version, &in_);
    if (!in_.ok()) return;
    fields["metadata"] = std::move(metadata);
    const std::string where = absl::StrCat("node ", ToString(NodeId(node->id)));
    const absl::Status read = ReadWhatCanBeRead(file_, where, &fields, &graph_.skips, node);
    if (!read.ok()) return in_.Fail("attributes", std::string(read.message()));
    FinishNode(std::move(fields), node);
    PackFields(node);
  }

  void ReadEdge() {
    SparkEdge edge;
    in_.Marker("edge", 3);
    edge.source = in_.Unsigned("edge source", UINT64_MAX);
    edge.target = in_.Unsigned("edge target", UINT64_MAX);
    const std::string class_name = ReadClass(edge_classes_);
    if (class_name != "EdgeAttributes") in_.Fail("edge class", "is none that the format has");
    Json metadata;
    if (Since({1, 0, 6})) metadata = ParseMetadata("metadata", kTextBytesMax);
    edge.own = TakeOwn(&metadata);
    edge.metadata = MetadataText(metadata);
    edge.weighted = in_.Bool("edge weighted");
    edge.weight = in_.Number("edge weight");
    if (in_.ok()) graph_.edges.push_back(std::move(edge));
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
