// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_writer.h"

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string>

#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_bytes.h"
#include "schema/interop/spark_fields.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Type = SparkFieldType;

// Handed over in pieces of about this size.
constexpr size_t kPieceBytes = size_t{256} << 10;

Json HeaderJson() {
  return {{"project_name", "main"},
          {"version",
           {{"major", kSparkVersionNewest.major},
            {"minor", kSparkVersionNewest.minor},
            {"patch", kSparkVersionNewest.patch}}}};
}

Json KeyJson(const SparkLayerKey& key) {
  return {{"layer", key.layer}, {"partition", key.partition}};
}

class JsonWriter {
 public:
  explicit JsonWriter(const ByteSink& sink) : sink_(sink) {}

  absl::Status Write(const SparkGraph& graph) {
    out_ = absl::StrCat("{\"SPARK_DSG_header\":", DumpJson(HeaderJson()),
                        ",\"directed\":false,\"multigraph\":false,\"layer_keys\":");
    Json keys = Json::array();
    for (const SparkLayerKey& key : graph.layer_keys) keys.push_back(KeyJson(key));
    Json names = Json::object();
    for (const auto& [name, key] : graph.layer_names) names[name] = KeyJson(key);
    const Json metadata = WithOwn(graph.metadata, graph.own);
    absl::StrAppend(&out_, DumpJson(keys), ",\"layer_names\":", DumpJson(names),
                    ",\"metadata\":", DumpJson(metadata), ",\n\"nodes\":");
    DSG_RETURN_IF_ERROR(Each(graph.nodes, [this](const SparkNode& node) { AddNode(node); }));
    out_ += ",\n\"edges\":";
    DSG_RETURN_IF_ERROR(Each(graph.edges, [this](const SparkEdge& edge) { AddEdge(edge); }));
    if (graph.mesh.has_value()) DSG_RETURN_IF_ERROR(WriteMesh(*graph.mesh));
    out_ += "}\n";
    return Flush(0);
  }

 private:
  absl::Status Flush(size_t limit) {
    if (out_.size() < limit) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(sink_(out_));
    out_.clear();
    return absl::OkStatus();
  }

  // A list with one item a line, so that two exports can be compared by eye.
  template <typename T, typename Add>
  absl::Status Each(const std::vector<T>& items, const Add& add) {
    const char* before = "[\n";
    for (const T& item : items) {
      out_ += before;
      add(item);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
      before = ",\n";
    }
    out_ += items.empty() ? "[]" : "]";
    return absl::OkStatus();
  }

  void AddNode(const SparkNode& node) {
    Json fields = AllFieldsOf(node);
    if (fields.is_null()) fields = MakeFields(node);
    if (!node.own.is_null()) fields["metadata"] = WithOwn(fields["metadata"], node.own);
    absl::StrAppend(&out_, "{\"id\":", node.id, ",\"layer\":", node.key.layer,
                    ",\"partition\":", node.key.partition, ",\"attributes\":", DumpJson(fields),
                    "}");
  }

  void AddEdge(const SparkEdge& edge) {
    const Json info = {{"type", "EdgeAttributes"},
                       {"metadata", WithOwn(MetadataJson(edge.metadata), edge.own)},
                       {"weighted", edge.weighted},
                       {"weight", edge.weight}};
    absl::StrAppend(&out_, "{\"source\":", edge.source, ",\"target\":", edge.target,
                    ",\"info\":", DumpJson(info), "}");
  }

  // The fewest digits that read back as the same single-precision number.
  void AddFloat(float value) {
    if (!std::isfinite(value)) {
      out_ += "null";
      return;
    }
    char digits[32];
    const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
    out_.append(digits, end);
  }

  template <typename T, typename Add>
  absl::Status Channel(const char* name, const std::vector<T>& items, const Add& add) {
    if (items.empty()) return absl::OkStatus();
    absl::StrAppend(&out_, ",\n\"", name, "\":");
    return Each(items, add);
  }

  absl::Status WriteMesh(const MeshBlock& mesh) {
    const auto flag = [](bool value) { return value ? "true" : "false"; };
    absl::StrAppend(&out_, ",\n\"mesh\":{\"header\":", DumpJson(HeaderJson()),
                    ",\"has_colors\":", flag(!mesh.colors.empty()),
                    ",\"has_timestamps\":", flag(!mesh.last_seen_ns.empty()),
                    ",\"has_labels\":", flag(!mesh.labels.empty()),
                    ",\"has_first_seen_stamps\":", flag(!mesh.first_seen_ns.empty()));
    const auto number = [this](auto value) { absl::StrAppend(&out_, value); };
    DSG_RETURN_IF_ERROR(Channel("points", mesh.positions_map, [this](const auto& point) {
      for (int i = 0; i < 3; ++i) {
        out_ += i == 0 ? '[' : ',';
        AddFloat(point[i]);
      }
      out_ += ']';
    }));
    DSG_RETURN_IF_ERROR(Channel("colors", mesh.colors, [this](uint32_t rgb) {
      absl::StrAppend(&out_, "{\"r\":", rgb >> 16 & 255, ",\"g\":", rgb >> 8 & 255,
                      ",\"b\":", rgb & 255, ",\"a\":255}");
    }));
    DSG_RETURN_IF_ERROR(Channel("stamps", mesh.last_seen_ns, number));
    DSG_RETURN_IF_ERROR(Channel("first_seen_stamps", mesh.first_seen_ns, number));
    DSG_RETURN_IF_ERROR(Channel("labels", mesh.labels, number));
    DSG_RETURN_IF_ERROR(Channel("faces", mesh.faces, [this](const auto& face) {
      absl::StrAppend(&out_, "[", face[0], ",", face[1], ",", face[2], "]");
    }));
    out_ += "}";
    return absl::OkStatus();
  }

  const ByteSink& sink_;
  std::string out_;
};

std::string TextOf(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

// One field of a node in the binary form, from its JSON.
class FieldWriter {
 public:
  explicit FieldWriter(SparkByteWriter* out) : out_(*out) {}

  void Write(Type type, const Json& value) {
    switch (type) {
      case Type::kVector3:
        return Doubles(value, 3);
      case Type::kVector2:
        return Matrix(value, 2, 1);
      case Type::kMatrix2:
        return Matrix(value, 2, 2);
      case Type::kUnsigned64:
      case Type::kNodeId:
        return out_.Unsigned64(PeekUnsigned(value));
      case Type::kUnsigned32:
      case Type::kLabel:
        return out_.Unsigned32(static_cast<uint32_t>(PeekUnsigned(value)));
      case Type::kTime:
        return out_.Signed64(PeekSigned(value));
      case Type::kNumber:
        return out_.Double(PeekNumber(value));
      case Type::kBool:
        return out_.Bool(PeekBool(value));
      case Type::kText:
        return out_.Text(TextOf(value));
      case Type::kColor:
        return Color(value);
      case Type::kBox:
        return Box(value);
      case Type::kQuaternion:
        out_.Array(4);
        for (const char* part : {"w", "x", "y", "z"}) out_.Double(PeekNumber(Peek(value, part)));
        return;
      default:
        return WriteLong(type, value);
    }
  }

 private:
  void WriteLong(Type type, const Json& value) {
    switch (type) {
      case Type::kFeature:
        return Feature(value);
      case Type::kColumnUnsigned32:
        out_.MatrixHead(Size(value), Size(value) > 0 ? 1 : 0);
        return Integers32(value);
      case Type::kColumnFloat:
        out_.MatrixHead(Size(value), Size(value) > 0 ? 1 : 0);
        return Floats(value, Size(value));
      case Type::kList64:
        return Each(value, [this](const Json& one) { out_.Unsigned64(PeekUnsigned(one)); });
      case Type::kList8:
        return Each(value, [this](const Json& one) {
          out_.Unsigned8(static_cast<uint8_t>(PeekUnsigned(one)));
        });
      case Type::kVectorList:
        return Each(value, [this](const Json& one) { Doubles(one, 3); });
      case Type::kFloatVectorList:
        return Each(value, [this](const Json& one) { Floats(one, 3); });
      case Type::kCloudList:
        return Each(value, [this](const Json& one) { Write(Type::kFloatVectorList, one); });
      case Type::kMeshLinks:
        return Each(value, [this](const Json& one) { MeshLink(one); });
      case Type::kProbabilities:
        return Named(value, [this](const Json& one) { out_.Double(PeekNumber(one)); });
      case Type::kDetails:
        return Named(value, [this](const Json& one) { Write(Type::kList64, one); });
      case Type::kMesh:
        return Mesh(value);
      default:
        return;
    }
  }

  static size_t Size(const Json& list) { return list.is_array() ? list.size() : 0; }

  template <typename WriteOne>
  void Each(const Json& list, const WriteOne& write) {
    out_.Array(Size(list));
    for (size_t i = 0; i < Size(list); ++i) write(list[i]);
  }

  template <typename WriteOne>
  void Named(const Json& values, const WriteOne& write) {
    const size_t count = values.is_object() ? values.size() : 0;
    out_.Array(count);
    if (count == 0) return;
    for (const auto& [name, value] : values.items()) {
      out_.Text(name);
      write(value);
    }
  }

  void Doubles(const Json& value, size_t count) {
    for (size_t i = 0; i < count; ++i) out_.Double(PeekNumber(PeekAt(value, i)));
  }
  void Floats(const Json& value, size_t count) {
    for (size_t i = 0; i < count; ++i) {
      out_.Float(static_cast<float>(PeekNumber(PeekAt(value, i))));
    }
  }
  void Integers32(const Json& list) {
    for (size_t i = 0; i < Size(list); ++i) {
      out_.Unsigned32(static_cast<uint32_t>(PeekUnsigned(list[i])));
    }
  }

  void Matrix(const Json& value, size_t rows, size_t columns) {
    out_.MatrixHead(rows, columns);
    Doubles(value, rows * columns);
  }

  void Color(const Json& value) {
    for (const char* part : {"r", "g", "b", "a"}) {
      out_.Unsigned8(static_cast<uint8_t>(PeekUnsigned(Peek(value, part))));
    }
  }

  void Box(const Json& box) {
    const Json& type = Peek(box, "type");
    int32_t number = static_cast<int32_t>(PeekUnsigned(type));
    for (int32_t i = 0; i < 4; ++i) {
      if (type == kSparkBoxNames[i]) number = i;
    }
    out_.Array(4);
    out_.Signed32(number);
    Floats(Peek(box, "dimensions"), 3);
    Floats(Peek(box, "world_P_center"), 3);
    const Json& q = Peek(box, "world_R_center");
    const Eigen::Quaterniond turn(PeekNumber(Peek(q, "w")), PeekNumber(Peek(q, "x")),
                                  PeekNumber(Peek(q, "y")), PeekNumber(Peek(q, "z")));
    const Eigen::Matrix3d rotation = turn.norm() != 0.0
                                         ? turn.normalized().toRotationMatrix()
                                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    out_.MatrixHead(3, 3);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        out_.Float(static_cast<float>(rotation(row, column)));
      }
    }
  }

  void Feature(const Json& value) {
    const Json& data = Peek(value, "data");
    const uint64_t rows = PeekUnsigned(Peek(value, "rows"));
    const uint64_t columns = PeekUnsigned(Peek(value, "cols"));
    const bool is_whole =
        rows <= Size(data) && columns <= Size(data) && rows * columns == Size(data);
    out_.MatrixHead(is_whole ? rows : Size(data), is_whole ? columns : 1);
    Floats(data, Size(data));
  }

  void MeshLink(const Json& link) {
    out_.Array(4);
    out_.Array(3);
    for (size_t i = 0; i < 3; ++i) {
      out_.Signed32(static_cast<int32_t>(PeekSigned(PeekAt(Peek(link, "block"), i))));
    }
    out_.Array(3);
    Doubles(Peek(link, "voxel_pos"), 3);
    out_.Unsigned64(PeekUnsigned(Peek(link, "vertex")));
    const Json& label = Peek(link, "label");
    if (label.is_number()) out_.Unsigned32(static_cast<uint32_t>(PeekUnsigned(label)));
    if (!label.is_number()) out_.Nil();
  }

  void Mesh(const Json& mesh) {
    for (const char* flag :
         {"has_colors", "has_timestamps", "has_labels", "has_first_seen_stamps"}) {
      out_.Bool(PeekBool(Peek(mesh, flag)));
    }
    Write(Type::kFloatVectorList, Peek(mesh, "points"));
    Each(Peek(mesh, "colors"), [this](const Json& one) { MeshColor(one); });
    Write(Type::kList64, Peek(mesh, "stamps"));
    out_.Array(Size(Peek(mesh, "labels")));
    Integers32(Peek(mesh, "labels"));
    Write(Type::kList64, Peek(mesh, "first_seen_stamps"));
    Each(Peek(mesh, "faces"), [this](const Json& face) {
      out_.Array(3);
      for (size_t i = 0; i < 3; ++i) out_.Unsigned64(PeekUnsigned(PeekAt(face, i)));
    });
  }

  // {r, g, b, a}, or a list in old files.
  void MeshColor(const Json& color) {
    if (color.is_object()) return Color(color);
    for (size_t i = 0; i < 4; ++i) {
      const bool is_there = i < Size(color);
      out_.Unsigned8(is_there ? static_cast<uint8_t>(PeekUnsigned(color[i])) : uint8_t{255});
    }
  }

  SparkByteWriter& out_;
};

// A node's type byte is an index into this list, which the file carries.
constexpr SparkClass kClasses[] = {
    SparkClass::kAgent,  SparkClass::kKhronosObject, SparkClass::kNode,
    SparkClass::kObject, SparkClass::kPlace,         SparkClass::kPlace2d,
    SparkClass::kRoom,   SparkClass::kSemantic,      SparkClass::kTraversability};

uint8_t IndexOf(SparkClass type) {
  for (uint8_t i = 0; i < std::size(kClasses); ++i) {
    if (kClasses[i] == type) return i;
  }
  return 0;
}

class BinaryWriter {
 public:
  explicit BinaryWriter(const ByteSink& sink) : sink_(sink) {}

  absl::Status Write(const SparkGraph& graph) {
    WriteHead(graph);
    out_.ListBegin();
    for (const SparkNode& node : graph.nodes) {
      WriteNode(node);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    out_.ListEnd();
    out_.ListBegin();
    for (const SparkEdge& edge : graph.edges) {
      WriteEdge(edge);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    out_.ListEnd();
    out_.Bool(graph.mesh.has_value());
    if (graph.mesh.has_value()) DSG_RETURN_IF_ERROR(WriteMesh(*graph.mesh));
    return Flush(0);
  }

 private:
  absl::Status Flush(size_t limit) {
    if (out_.bytes().size() < limit) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(sink_(out_.bytes()));
    out_.bytes().clear();
    return absl::OkStatus();
  }

  void WriteHead(const SparkGraph& graph) {
    out_.Text("SPARK_DSG");
    out_.Text("main");
    out_.Unsigned8(kSparkVersionNewest.major);
    out_.Unsigned8(kSparkVersionNewest.minor);
    out_.Unsigned8(kSparkVersionNewest.patch);
    out_.Array(graph.layer_keys.size());
    for (const SparkLayerKey& key : graph.layer_keys) WriteKey(key);
    out_.Array(std::size(kClasses));
    for (const SparkClass type : kClasses) out_.Text(NameOf(type));
    out_.Array(1);
    out_.Text("EdgeAttributes");
    out_.Array(graph.layer_names.size());
    for (const auto& [name, key] : graph.layer_names) {
      out_.Text(name);
      WriteKey(key);
    }
    out_.Text(DumpJson(WithOwn(graph.metadata, graph.own)));
  }

  void WriteKey(const SparkLayerKey& key) {
    out_.Array(2);
    out_.Signed64(key.layer);
    out_.Unsigned32(key.partition);
  }

  void WriteNode(const SparkNode& node) {
    const Json read = AllFieldsOf(node);
    const Json fields = read.is_null() ? MakeFields(node) : read;
    out_.Array(4);
    out_.Signed64(node.key.layer);
    out_.Unsigned64(node.id);
    out_.Unsigned32(node.key.partition);
    out_.Unsigned8(IndexOf(node.type));
    out_.Text(DumpJson(WithOwn(Peek(fields, "metadata"), node.own)));
    for (const SparkField& field : FieldsOf(node.type)) {
      FieldWriter(&out_).Write(field.type, Peek(fields, field.name));
    }
  }

  void WriteEdge(const SparkEdge& edge) {
    out_.Array(3);
    out_.Unsigned64(edge.source);
    out_.Unsigned64(edge.target);
    out_.Unsigned8(0);
    out_.Text(DumpJson(WithOwn(MetadataJson(edge.metadata), edge.own)));
    out_.Bool(edge.weighted);
    out_.Double(edge.weight);
  }

  template <typename T, typename WriteOne>
  absl::Status Channel(const std::vector<T>& items, const WriteOne& write) {
    out_.Array(items.size());
    for (const T& item : items) {
      write(item);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    return absl::OkStatus();
  }

  absl::Status WriteMesh(const MeshBlock& mesh) {
    out_.Bool(!mesh.colors.empty());
    out_.Bool(!mesh.last_seen_ns.empty());
    out_.Bool(!mesh.labels.empty());
    out_.Bool(!mesh.first_seen_ns.empty());
    DSG_RETURN_IF_ERROR(Channel(mesh.positions_map, [this](const Eigen::Vector3f& point) {
      for (int i = 0; i < 3; ++i) out_.Float(point[i]);
    }));
    DSG_RETURN_IF_ERROR(Channel(mesh.colors, [this](uint32_t rgb) {
      for (const int shift : {16, 8, 0}) out_.Unsigned8(static_cast<uint8_t>(rgb >> shift));
      out_.Unsigned8(255);
    }));
    const auto stamp = [this](TimeNs time_ns) {
      out_.Unsigned64(time_ns < 0 ? 0 : static_cast<uint64_t>(time_ns));
    };
    DSG_RETURN_IF_ERROR(Channel(mesh.last_seen_ns, stamp));
    DSG_RETURN_IF_ERROR(Channel(mesh.labels, [this](uint32_t label) { out_.Unsigned32(label); }));
    DSG_RETURN_IF_ERROR(Channel(mesh.first_seen_ns, stamp));
    return Channel(mesh.faces, [this](const std::array<uint32_t, 3>& face) {
      out_.Array(3);
      for (const uint32_t vertex : face) out_.Unsigned64(vertex);
    });
  }

  const ByteSink& sink_;
  SparkByteWriter out_;
};

}  // namespace

absl::Status WriteSpark(const SparkGraph& graph, SparkForm form, const ByteSink& sink) {
  return form == SparkForm::kJson ? JsonWriter(sink).Write(graph) : BinaryWriter(sink).Write(graph);
}

std::string SparkToBytes(const SparkGraph& graph, SparkForm form) {
  std::string bytes;
  const absl::Status status = WriteSpark(graph, form, [&bytes](std::string_view piece) {
    bytes += piece;
    return absl::OkStatus();
  });
  DSG_CHECK(status.ok());
  return bytes;
}

}  // namespace dsg
