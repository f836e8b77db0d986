// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/ply_header.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/objects/shapes/mesh_file_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kHeaderBytesMax = 64 << 10;

constexpr std::pair<std::string_view, PlyType> kTypeNames[] = {
    {"char", PlyType::kInt8},     {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
    {"uint8", PlyType::kUint8},   {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
    {"ushort", PlyType::kUint16}, {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
    {"int32", PlyType::kInt32},   {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
    {"float", PlyType::kFloat},   {"float32", PlyType::kFloat}, {"double", PlyType::kDouble},
    {"float64", PlyType::kDouble}};

std::optional<PlyType> TypeOf(std::string_view name) {
  for (const auto& [known, type] : kTypeNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, const std::string& file)
      : file_(file), words_(bytes.substr(0, kHeaderBytesMax), 0, 1) {}

  absl::StatusOr<PlyHeader> Parse(std::string_view bytes) {
    if (words_.NextInLine() != "ply") return CadFileError(file_, "does not begin with \"ply\"");
    while (words_.SkipLine()) {
      const std::string_view statement = words_.NextInLine();
      if (statement == "end_header") return Finish(bytes, statement);
      DSG_RETURN_IF_ERROR(ReadStatement(statement));
    }
    return CadLineError(file_, words_.line(),
                        "the header does not end; the file was cut or is no PLY");
  }

 private:
  absl::Status ReadStatement(std::string_view statement) {
    if (statement == "format") return ReadFormat();
    if (statement == "element") return ReadElement();
    if (statement == "property") return ReadProperty();
    if (statement == "comment" || statement == "obj_info" || statement.empty()) {
      return absl::OkStatus();
    }
    return Error(absl::StrCat(Quoted(statement), " is no statement of a PLY header"));
  }

  absl::Status ReadFormat() {
    const std::string_view format = words_.NextInLine();
    has_format_ = true;
    header_.is_ascii = format == "ascii";
    if (header_.is_ascii || format == "binary_little_endian") return absl::OkStatus();
    return Error(absl::StrCat("format ", Quoted(format),
                              " is not read; save as ascii or binary_little_endian"));
  }

  absl::Status ReadElement() {
    PlyElement element;
    element.name = std::string(words_.NextInLine());
    const std::string_view count = words_.NextInLine();
    if (!ParseCadInteger(count, &element.count) || element.count < 0) {
      return Error(absl::StrCat("element ", Quoted(element.name), " has count ", Quoted(count)));
    }
    const int64_t count_max = element.name == "vertex" ? kCadVertexCountMax
                              : element.name == "face" ? kCadFaceCountMax
                                                       : kCadFileBytesMax;
    if (element.count > count_max) {
      return Error(absl::StrCat("element ", Quoted(element.name), " has count ", element.count,
                                ", more than ", count_max, "; simplify the model"));
    }
    header_.elements.push_back(std::move(element));
    return absl::OkStatus();
  }

  absl::Status ReadProperty() {
    if (header_.elements.empty()) return Error("a property before the first element");
    PlyProperty property;
    std::string_view word = words_.NextInLine();
    if (word == "list") {
      property.is_list = true;
      const std::string_view count_word = words_.NextInLine();
      const std::optional<PlyType> count_type = TypeOf(count_word);
      if (!count_type || !IsInteger(*count_type)) {
        return Error(absl::StrCat("a list counted with type ", Quoted(count_word)));
      }
      property.count_type = *count_type;
      word = words_.NextInLine();
    }
    const std::optional<PlyType> type = TypeOf(word);
    if (!type) return Error(absl::StrCat("a property of type ", Quoted(word)));
    property.type = *type;
    property.name = std::string(words_.NextInLine());
    header_.elements.back().properties.push_back(std::move(property));
    return absl::OkStatus();
  }

  absl::StatusOr<PlyHeader> Finish(std::string_view bytes, std::string_view last_word) {
    if (!has_format_) return Error("the header has no format statement");
    const size_t word_end = static_cast<size_t>(last_word.data() - bytes.data()) + last_word.size();
    const size_t line_end = bytes.find('\n', word_end);
    if (line_end == std::string_view::npos) return Error("the file ends with its header");
    header_.body_offset = line_end + 1;
    header_.body_line = words_.line() + 1;
    return std::move(header_);
  }

  absl::Status Error(const std::string& message) const {
    return CadLineError(file_, words_.line(), message);
  }

  const std::string& file_;
  WordReader words_;
  PlyHeader header_;
  bool has_format_ = false;
};

}  // namespace

int ByteCount(PlyType type) {
  constexpr int kByteCounts[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kByteCounts[static_cast<size_t>(type)];
}

int PlyElement::Find(std::string_view property_name) const {
  const auto found =
      std::find_if(properties.begin(), properties.end(),
                   [&](const PlyProperty& property) { return property.name == property_name; });
  return found == properties.end() ? -1 : static_cast<int>(found - properties.begin());
}

absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view bytes, const std::string& file) {
  return HeaderParser(bytes, file).Parse(bytes);
}

}  // namespace dsg::ingest
