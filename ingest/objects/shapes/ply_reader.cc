// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/objects/shapes/mesh_file_internal.h"
#include "ingest/objects/shapes/ply_header.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// One number after the other, whatever the encoding; doubles hold every type exactly.
class NumberReader {
 public:
  NumberReader(std::string_view bytes, const PlyHeader& header, const std::string& file)
      : bytes_(bytes),
        file_(file),
        is_ascii_(header.is_ascii),
        at_(header.body_offset),
        words_(bytes, header.body_offset, header.body_line) {}

  absl::Status Read(PlyType type, double* value) {
    return is_ascii_ ? ReadWord(type, value) : ReadBytes(type, value);
  }

  absl::Status Error(const std::string& message) const {
    if (is_ascii_) return CadLineError(file_, words_.line(), message);
    return CadFileError(file_, absl::StrCat("before byte ", at_, ": ", message));
  }

  /// Errors: FILE_MALFORMED when something is left that is not blank.
  absl::Status CheckEnd() {
    const std::string_view rest =
        is_ascii_ ? words_.Next() : WordReader(bytes_.substr(at_), 0, 1).Next();
    if (rest.empty()) return absl::OkStatus();
    return Error("there is more after the last element that the header promises");
  }

 private:
  absl::Status ReadWord(PlyType type, double* value) {
    const std::string_view word = words_.Next();
    if (word.empty()) return Error("the file ends before what its header promises; it was cut");
    const bool is_number = ParseCadNumber(word, value);
    if (is_number && (!IsInteger(type) || std::nearbyint(*value) == *value)) {
      return absl::OkStatus();
    }
    return Error(absl::StrCat(Quoted(word), is_number ? " is no integer" : " is no finite number"));
  }

  absl::Status ReadBytes(PlyType type, double* value) {
    const auto size = static_cast<size_t>(ByteCount(type));
    if (bytes_.size() - at_ < size) {
      return Error(absl::StrCat("the file ends at byte ", bytes_.size(),
                                ", before what its header promises; it was cut"));
    }
    const char* const from = bytes_.data() + at_;
    at_ += size;
    switch (type) {
      case PlyType::kInt8:
        *value = Take<int8_t>(from);
        break;
      case PlyType::kUint8:
        *value = Take<uint8_t>(from);
        break;
      case PlyType::kInt16:
        *value = Take<int16_t>(from);
        break;
      case PlyType::kUint16:
        *value = Take<uint16_t>(from);
        break;
      case PlyType::kInt32:
        *value = Take<int32_t>(from);
        break;
      case PlyType::kUint32:
        *value = Take<uint32_t>(from);
        break;
      case PlyType::kFloat:
        *value = Take<float>(from);
        break;
      case PlyType::kDouble:
        *value = Take<double>(from);
        break;
    }
    return absl::OkStatus();
  }

  template <typename T>
  static double Take(const char* from) {
    T value;
    std::memcpy(&value, from, sizeof(T));
    return static_cast<double>(value);
  }

  std::string_view bytes_;
  const std::string& file_;
  bool is_ascii_;
  size_t at_;
  WordReader words_;
};

// Reads one property; the values of the list or the single value.
absl::Status ReadProperty(const PlyProperty& property, NumberReader* numbers,
                          std::vector<double>* values) {
  values->clear();
  double count = 1.0;
  if (property.is_list) {
    DSG_RETURN_IF_ERROR(numbers->Read(property.count_type, &count));
    if (count < 0.0 || count > static_cast<double>(kCadFileBytesMax)) {
      return numbers->Error(absl::StrCat("a list of ", count, " values"));
    }
  }
  for (int64_t i = 0; i < static_cast<int64_t>(count); ++i) {
    double value = 0.0;
    DSG_RETURN_IF_ERROR(numbers->Read(property.type, &value));
    values->push_back(value);
  }
  return absl::OkStatus();
}

absl::Status ReadVertices(const PlyElement& element, NumberReader* numbers, TriangleSoup* mesh) {
  const int axes[3] = {element.Find("x"), element.Find("y"), element.Find("z")};
  for (const int axis : axes) {
    if (axis < 0 || element.properties[static_cast<size_t>(axis)].is_list) {
      return numbers->Error("the vertices have no x, y and z");
    }
  }
  std::vector<double> values;
  for (int64_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d vertex;
    for (size_t p = 0; p < element.properties.size(); ++p) {
      DSG_RETURN_IF_ERROR(ReadProperty(element.properties[p], numbers, &values));
      for (int axis = 0; axis < 3; ++axis) {
        if (axes[axis] == static_cast<int>(p)) vertex[axis] = values.front();
      }
    }
    if (!vertex.allFinite()) {
      return numbers->Error(absl::StrCat("vertex ", i, " has a coordinate that is no number"));
    }
    mesh->vertices.push_back(vertex);
  }
  return absl::OkStatus();
}

absl::Status AddFace(const std::vector<double>& values, int64_t face, int64_t vertex_count,
                     const NumberReader& numbers, TriangleSoup* mesh) {
  std::vector<uint32_t> corners;
  for (const double value : values) {
    if (!(value >= 0.0 && value < static_cast<double>(vertex_count))) {
      return numbers.Error(
          absl::StrCat("face ", face, " has vertex ", value, " of ", vertex_count));
    }
    corners.push_back(static_cast<uint32_t>(value));
  }
  if (corners.size() < 3) {
    return numbers.Error(absl::StrCat("face ", face, " has ", corners.size(), " corners"));
  }
  if (static_cast<int64_t>(mesh->faces.size() + corners.size()) > kCadFaceCountMax + 2) {
    return numbers.Error(absl::StrCat("more than ", kCadFaceCountMax, " triangles; simplify it"));
  }
  mesh->AddPolygon(corners);
  return absl::OkStatus();
}

absl::Status ReadFaces(const PlyElement& element, int64_t vertex_count, NumberReader* numbers,
                       TriangleSoup* mesh) {
  int list = element.Find("vertex_indices");
  if (list < 0) list = element.Find("vertex_index");
  if (element.count > 0 && (list < 0 || !element.properties[static_cast<size_t>(list)].is_list)) {
    return numbers->Error("the faces have no list \"vertex_indices\"");
  }
  std::vector<double> values;
  for (int64_t i = 0; i < element.count; ++i) {
    for (size_t p = 0; p < element.properties.size(); ++p) {
      DSG_RETURN_IF_ERROR(ReadProperty(element.properties[p], numbers, &values));
      if (static_cast<int>(p) != list) continue;
      DSG_RETURN_IF_ERROR(AddFace(values, i, vertex_count, *numbers, mesh));
    }
  }
  return absl::OkStatus();
}

absl::Status SkipElement(const PlyElement& element, NumberReader* numbers) {
  if (element.properties.empty()) return absl::OkStatus();
  std::vector<double> values;
  for (int64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      DSG_RETURN_IF_ERROR(ReadProperty(property, numbers, &values));
    }
  }
  return absl::OkStatus();
}

int64_t VertexCountOf(const PlyHeader& header) {
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") return element.count;
  }
  return 0;
}

}  // namespace

absl::StatusOr<TriangleSoup> ReadPly(std::string_view bytes, const std::string& file) {
  DSG_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(bytes, file));
  NumberReader numbers(bytes, header, file);
  TriangleSoup mesh;
  bool has_vertices = false;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" && !has_vertices) {
      has_vertices = true;
      DSG_RETURN_IF_ERROR(ReadVertices(element, &numbers, &mesh));
    } else if (element.name == "face") {
      DSG_RETURN_IF_ERROR(ReadFaces(element, VertexCountOf(header), &numbers, &mesh));
    } else {
      DSG_RETURN_IF_ERROR(SkipElement(element, &numbers));
    }
  }
  DSG_RETURN_IF_ERROR(numbers.CheckEnd());
  return mesh;
}

}  // namespace dsg::ingest
