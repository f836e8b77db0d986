// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_binary_fields.h"

#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_document.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_json_mesh.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Type = SparkFieldType;

constexpr uint64_t kUint32Max = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kUint64Max = std::numeric_limits<uint64_t>::max();
constexpr size_t kTextBytesMax = size_t{1} << 20;
constexpr SparkVersion kNewColorsAndBoxes = {1, 0, 3};

Json VectorJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

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
        return in_.Unsigned(name, kUint64Max);
      case Type::kUnsigned32:
      case Type::kLabel:
        return in_.Unsigned(name, kUint32Max);
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
        return Quaternion(in_.Quaternion(name));
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
        return Integers(name, kUint64Max);
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
        return Named(name, [this, name] { return Integers(name, kUint64Max); });
      case Type::kMesh:
        return SparkMeshToJson(ReadBinaryMesh(&in_));
      default:
        return nullptr;
    }
  }

  static constexpr size_t kLinkBytesMin = 35;

  static Json Quaternion(const Eigen::Quaterniond& q) {
    return {{"w", q.w()}, {"x", q.x()}, {"y", q.y()}, {"z", q.z()}};
  }

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
            {"world_R_center", Quaternion(Eigen::Quaterniond(Eigen::Matrix3d(rotation)))}};
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
    const uint64_t columns = in_.Unsigned(name, kUint32Max);
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
      if (!is_float) data.push_back(in_.Unsigned(name, kUint32Max));
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
    link["vertex"] = in_.Unsigned("voxblox_mesh_connections vertex", kUint64Max);
    link["label"] = nullptr;
    if (!in_.TakeNil()) link["label"] = in_.Unsigned("voxblox_mesh_connections label", kUint32Max);
    return link;
  }

  const SparkVersion& version_;
  SparkByteReader& in_;
  size_t value_count_ = 0;
};

uint32_t MeshWord(const char* field, SparkByteReader* in) {
  return static_cast<uint32_t>(in->Unsigned(field, kUint32Max));
}

uint32_t MeshColor(SparkByteReader* in) {
  uint32_t rgb = 0;
  for (int i = 0; i < 3; ++i) {
    rgb = rgb << 8 | static_cast<uint32_t>(in->Unsigned("mesh colors", 255));
  }
  in->Unsigned("mesh colors", 255);
  return rgb;
}

}  // namespace

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

MeshBlock ReadBinaryMesh(SparkByteReader* in) {
  // What the mesh was made to hold; the lists below say what it holds.
  for (const char* flag : {"has_colors", "has_timestamps", "has_labels", "has_first_seen"}) {
    in->Bool(flag);
  }
  const auto stamp = [in] { return StampOrZero(in->Unsigned("mesh stamps", kUint64Max)); };
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

}  // namespace dsg
