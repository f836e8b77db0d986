// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/label_table.h"

#include "absl/strings/str_cat.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::ingest {
namespace {

constexpr char kLabelHeader[] = "name,red,green,blue,alpha,id";
// Label images keep a class in eight bits.
constexpr int64_t kClassMax = 255;

absl::StatusOr<uint32_t> ReadBounded(const LinePosition& at, std::string_view field,
                                     std::string_view text, int64_t max) {
  DSG_ASSIGN_OR_RETURN(const int64_t value, ParseInteger(at, field, text));
  if (value < 0 || value > max) {
    return at.FieldError(field, text, absl::StrCat("0 to ", max, " is due"));
  }
  return static_cast<uint32_t>(value);
}

absl::StatusOr<LabelRow> ReadLabelRow(const LinePosition& at,
                                      const std::vector<std::string_view>& fields) {
  LabelRow row;
  row.name = std::string(fields[0]);
  if (row.name.empty() || row.name.size() > 1024 || !IsUtf8(row.name)) {
    return at.FieldError("name", row.name, "a name in UTF-8 of at most 1024 bytes is due");
  }
  DSG_ASSIGN_OR_RETURN(const uint32_t red, ReadBounded(at, "red", fields[1], 255));
  DSG_ASSIGN_OR_RETURN(const uint32_t green, ReadBounded(at, "green", fields[2], 255));
  DSG_ASSIGN_OR_RETURN(const uint32_t blue, ReadBounded(at, "blue", fields[3], 255));
  DSG_RETURN_IF_ERROR(ReadBounded(at, "alpha", fields[4], 255).status());
  DSG_ASSIGN_OR_RETURN(const uint32_t id, ReadBounded(at, "id", fields[5], kClassMax));
  row.rgb = red << 16 | green << 8 | blue;
  row.class_id = static_cast<int32_t>(id);
  return row;
}

}  // namespace

std::map<uint32_t, int32_t> LabelTable::ClassOfColor() const {
  std::map<uint32_t, int32_t> classes;
  for (const LabelRow& row : rows) classes.try_emplace(row.rgb, row.class_id);
  return classes;
}

std::vector<SemanticLabel> LabelTable::Classes() const {
  std::map<int32_t, std::string> name_of;
  for (const LabelRow& row : rows) name_of.try_emplace(row.class_id, row.name);
  std::vector<SemanticLabel> classes;
  for (const auto& [id, name] : name_of) classes.push_back({id, name});
  return classes;
}

absl::StatusOr<LabelTable> ReadLabelTable(const LogFile& file) {
  LabelTable table;
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  bool has_header = false;
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    SplitAtCommas(line.text, &fields);
    if (!has_header) {
      if (line.text != kLabelHeader) {
        return at.FieldError("header", line.text, absl::StrCat("\"", kLabelHeader, "\" is due"));
      }
      has_header = true;
      continue;
    }
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 6, kLabelHeader));
    DSG_ASSIGN_OR_RETURN(LabelRow row, ReadLabelRow(at, fields));
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace dsg::ingest
