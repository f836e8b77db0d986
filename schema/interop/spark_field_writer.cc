// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_field_writer.h"

#include <Eigen/Geometry>
#include <string>

#include "schema/interop/json_peek.h"

namespace dsg {
namespace {

using Json = nlohmann::json;
using Type = SparkFieldType;

std::string TextOf(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

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
    constexpr const char* kNames[] = {"INVALID", "AABB", "OBB", "RAABB"};
    const Json& type = Peek(box, "type");
    int32_t number = static_cast<int32_t>(PeekUnsigned(type));
    for (int32_t i = 0; i < 4; ++i) {
      if (type == kNames[i]) number = i;
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

}  // namespace

void WriteSparkField(SparkFieldType type, const Json& value, SparkByteWriter* out) {
  FieldWriter(out).Write(type, value);
}

}  // namespace dsg
