// SPDX-License-Identifier: Apache-2.0
#include "query/cli/triangle_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr size_t kBytesMax = 64u << 20;
constexpr int64_t kCountMax = 1'000'000;

absl::Status Malformed(const std::string& name, const std::string& what) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(name, ": ", what,
                                "; give a PLY file of triangles, ASCII or binary "
                                "little endian"),
                   {{"field", "--mesh"}, {"value", name}});
}

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Type> TypeNamed(const std::string& name) {
  if (name == "char" || name == "int8") return Type::kInt8;
  if (name == "uchar" || name == "uint8") return Type::kUint8;
  if (name == "short" || name == "int16") return Type::kInt16;
  if (name == "ushort" || name == "uint16") return Type::kUint16;
  if (name == "int" || name == "int32") return Type::kInt32;
  if (name == "uint" || name == "uint32") return Type::kUint32;
  if (name == "float" || name == "float32") return Type::kFloat;
  if (name == "double" || name == "float64") return Type::kDouble;
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type = Type::kFloat;
  // The type of the length; lists only.
  std::optional<Type> length_type;
};

struct Element {
  std::string name;
  int64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  bool is_ascii = true;
  std::vector<Element> elements;
  size_t body_begin = 0;
};

// Reads one word or one binary number after the other.
class Values {
 public:
  Values(const std::string& bytes, const Header& header)
      : bytes_(bytes), is_ascii_(header.is_ascii), position_(header.body_begin) {}

  std::optional<double> Next(Type type) { return is_ascii_ ? NextWord() : NextBinary(type); }

 private:
  std::optional<double> NextWord() {
    constexpr char kBlank[] = " \t\r\n";
    const size_t begin = bytes_.find_first_not_of(kBlank, position_);
    if (begin == std::string::npos) return std::nullopt;
    const size_t end = std::min(bytes_.find_first_of(kBlank, begin), bytes_.size());
    double value = 0.0;
    position_ = end;
    if (!absl::SimpleAtod(bytes_.substr(begin, end - begin), &value)) return std::nullopt;
    return value;
  }

  template <class T>
  std::optional<double> Take() {
    if (bytes_.size() - position_ < sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return static_cast<double>(value);
  }

  std::optional<double> NextBinary(Type type) {
    switch (type) {
      case Type::kInt8:
        return Take<int8_t>();
      case Type::kUint8:
        return Take<uint8_t>();
      case Type::kInt16:
        return Take<int16_t>();
      case Type::kUint16:
        return Take<uint16_t>();
      case Type::kInt32:
        return Take<int32_t>();
      case Type::kUint32:
        return Take<uint32_t>();
      case Type::kFloat:
        return Take<float>();
      case Type::kDouble:
        return Take<double>();
    }
    return std::nullopt;
  }

  const std::string& bytes_;
  const bool is_ascii_;
  size_t position_;
};

absl::Status TakeHeaderLine(const std::vector<std::string>& words, const std::string& name,
                            Header* header) {
  const bool is_element = words[0] == "element" && words.size() == 3;
  const bool is_list = words[0] == "property" && words.size() == 5 && words[1] == "list";
  const bool is_scalar = words[0] == "property" && words.size() == 3;
  if (words[0] == "format" && words.size() >= 2) {
    if (words[1] != "ascii" && words[1] != "binary_little_endian") {
      return Malformed(name, absl::StrCat("format ", words[1], " is not read"));
    }
    header->is_ascii = words[1] == "ascii";
  } else if (is_element) {
    Element element{.name = words[1]};
    if (!absl::SimpleAtoi(words[2], &element.count) || element.count < 0 ||
        element.count > kCountMax) {
      return Malformed(name, absl::StrCat("element ", words[1], " has a count of ", words[2]));
    }
    header->elements.push_back(std::move(element));
  } else if ((is_list || is_scalar) && !header->elements.empty()) {
    Property property{.name = words.back()};
    const auto type = TypeNamed(words[words.size() - 2]);
    if (is_list) property.length_type = TypeNamed(words[2]);
    if (!type.has_value() || (is_list && !property.length_type.has_value())) {
      return Malformed(name, absl::StrCat("property ", words.back(), " has an unknown type"));
    }
    property.type = *type;
    header->elements.back().properties.push_back(std::move(property));
  } else if (words[0] != "comment" && words[0] != "obj_info" && words[0] != "ply") {
    return Malformed(name, absl::StrCat("a header line begins with \"", words[0], "\""));
  }
  return absl::OkStatus();
}

absl::StatusOr<Header> ParseHeader(const std::string& bytes, const std::string& name) {
  if (bytes.compare(0, 3, "ply") != 0) return Malformed(name, "does not begin with \"ply\"");
  Header header;
  for (size_t begin = 0; begin < bytes.size();) {
    const size_t end = bytes.find('\n', begin);
    if (end == std::string::npos) break;
    const std::vector<std::string> words = absl::StrSplit(
        bytes.substr(begin, end - begin), absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    begin = end + 1;
    if (words.empty()) continue;
    if (words[0] == "end_header") {
      header.body_begin = begin;
      return header;
    }
    DSG_RETURN_IF_ERROR(TakeHeaderLine(words, name, &header));
  }
  return Malformed(name, "its header does not end");
}

// One row of an element: scalars by property, and the last list.
struct PlyRow {
  std::vector<double> scalars;
  std::vector<double> list;
};

bool ReadRow(const Element& element, Values* values, PlyRow* row) {
  constexpr double kListMax = 1000.0;
  row->scalars.clear();
  row->list.clear();
  for (const Property& property : element.properties) {
    if (!property.length_type.has_value()) {
      const auto value = values->Next(property.type);
      if (!value.has_value()) return false;
      row->scalars.push_back(*value);
      continue;
    }
    row->scalars.push_back(0.0);
    const auto length = values->Next(*property.length_type);
    if (!length.has_value() || *length < 0.0 || *length > kListMax) return false;
    const bool is_corners = property.name == "vertex_indices" || property.name == "vertex_index";
    for (int i = 0; i < static_cast<int>(*length); ++i) {
      const auto value = values->Next(property.type);
      if (!value.has_value()) return false;
      if (is_corners) row->list.push_back(*value);
    }
  }
  return true;
}

absl::Status AddVertex(const Element& element, const PlyRow& row, const std::string& name,
                       Triangles* out) {
  Eigen::Vector3f vertex = Eigen::Vector3f::Constant(std::nanf(""));
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const std::string& axis = element.properties[i].name;
    if (axis.size() == 1 && axis[0] >= 'x' && axis[0] <= 'z') {
      vertex[axis[0] - 'x'] = static_cast<float>(row.scalars[i]);
    }
  }
  if (!vertex.allFinite()) return Malformed(name, "a vertex has no finite x, y and z");
  out->vertices.push_back(vertex);
  return absl::OkStatus();
}

absl::Status AddFace(const PlyRow& row, const std::string& name, Triangles* out) {
  const auto count = static_cast<double>(out->vertices.size());
  for (const double index : row.list) {
    if (!(index >= 0.0 && index < count)) return Malformed(name, "a face has an unknown vertex");
  }
  for (size_t i = 2; i < row.list.size(); ++i) {
    out->faces.push_back({static_cast<uint32_t>(row.list[0]),
                          static_cast<uint32_t>(row.list[i - 1]),
                          static_cast<uint32_t>(row.list[i])});
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Triangles> ParseTriangles(const std::string& bytes, const std::string& name) {
  DSG_ASSIGN_OR_RETURN(const Header header, ParseHeader(bytes, name));
  Triangles out;
  Values values(bytes, header);
  PlyRow row;
  for (const Element& element : header.elements) {
    for (int64_t i = 0; i < element.count; ++i) {
      if (!ReadRow(element, &values, &row)) {
        return Malformed(name, absl::StrCat("element ", element.name, " ", i, " cannot be read"));
      }
      if (element.name == "vertex") DSG_RETURN_IF_ERROR(AddVertex(element, row, name, &out));
      if (element.name == "face") DSG_RETURN_IF_ERROR(AddFace(row, name, &out));
    }
  }
  if (out.faces.empty()) return Malformed(name, "has no triangles");
  return out;
}

absl::StatusOr<Triangles> ReadTriangles(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file)
    return absl::NotFoundError(
        absl::StrCat("--mesh ", path, ": cannot be read; check the path and its permissions"));
  if (file.tellg() > static_cast<std::streamoff>(kBytesMax)) {
    return Malformed(path, "is larger than 64 MiB");
  }
  file.seekg(0);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return ParseTriangles(bytes.str(), path);
}

}  // namespace dsg::cli
