// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/label_table.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
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

// Where the columns of a table are that are read.
struct IdColumns {
  char comma = ',';
  size_t id = 0;
  size_t name = 1;
};

bool IsNoClass(const std::string& name) {
  constexpr std::string_view kNoClass[] = {"unknown", "unlabeled",  "unlabelled", "unannotated",
                                           "void",    "background", "ignore",     "none",
                                           "null",    "undefined"};
  const std::string lower = absl::AsciiStrToLower(name);
  return std::find(std::begin(kNoClass), std::end(kNoClass), lower) != std::end(kNoClass);
}

void SplitIds(std::string_view text, char comma, std::vector<std::string_view>* fields) {
  if (comma != ' ') return SplitAtCommas(text, fields, comma);
  const size_t end = text.find_first_of(" \t");
  fields->assign(1, text.substr(0, end));
  const size_t name = end == std::string_view::npos ? end : text.find_first_not_of(" \t", end);
  if (name != std::string_view::npos) fields->push_back(text.substr(name));
}

char CommaOfIds(std::string_view line) {
  for (const char comma : {',', ';', '\t'}) {
    if (line.find(comma) != std::string_view::npos) return comma;
  }
  return ' ';
}

// True if the line is a header, whose columns go to `columns`.
absl::StatusOr<bool> ReadIdHeader(const LinePosition& at, std::string_view line,
                                  IdColumns* columns) {
  columns->comma = CommaOfIds(line);
  std::vector<std::string_view> fields;
  SplitIds(line, columns->comma, &fields);
  if (ParseInteger(at, "id", fields[0]).ok()) return false;
  std::optional<size_t> id;
  std::optional<size_t> name;
  for (size_t i = 0; i < fields.size(); ++i) {
    const std::string field = absl::AsciiStrToLower(std::string(fields[i]));
    if (field == "id" && !id.has_value()) id = i;
    if (field == "name" && !name.has_value()) name = i;
  }
  if (!id.has_value() || !name.has_value()) {
    return at.FieldError("header", line, "the columns \"id\" and \"name\" are due");
  }
  columns->id = *id;
  columns->name = *name;
  return true;
}

}  // namespace

absl::StatusOr<LabelIds> ReadLabelIds(const LogFile& file) {
  std::map<int64_t, std::string> name_of;
  LabelIds ids;
  IdColumns columns;
  LineReader lines(file.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  bool is_first = true;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{file.path, line.number};
    if (std::exchange(is_first, false)) {
      DSG_ASSIGN_OR_RETURN(const bool is_header, ReadIdHeader(at, line.text, &columns));
      if (is_header) continue;
    }
    SplitIds(line.text, columns.comma, &fields);
    if (fields.size() <= std::max(columns.id, columns.name)) {
      return at.Error("an id and a name are due");
    }
    DSG_ASSIGN_OR_RETURN(const uint32_t id,
                         ReadBounded(at, "id", fields[columns.id], LabelIds::kCount - 1));
    std::string name(fields[columns.name]);
    if (name.empty() || name.size() > 1024 || !IsUtf8(name)) {
      return at.FieldError("name", name, "a name in UTF-8 of at most 1024 bytes is due");
    }
    if (ids.is_listed[id]) return at.FieldError("id", fields[columns.id], "stands twice");
    ids.is_listed[id] = true;
    if (!IsNoClass(name)) name_of.emplace(id, std::move(name));
  }
  ids.is_renumbered =
      !name_of.empty() && (name_of.begin()->first < 1 || name_of.rbegin()->first > kClassMax);
  std::map<std::string, int32_t> class_of_name;
  for (const auto& [id, name] : name_of) {
    const auto next = static_cast<int32_t>(ids.is_renumbered ? std::ssize(ids.classes) + 1 : id);
    const auto [known, is_new] = class_of_name.try_emplace(name, next);
    if (is_new) ids.classes.push_back({next, name});
    ids.label_of_id[static_cast<size_t>(id)] = static_cast<uint16_t>(known->second << 8);
  }
  if (!ids.classes.empty() && std::ssize(ids.classes) <= kClassMax) return ids;
  return MalformedFile(file.path, absl::StrCat("names ", ids.classes.size(), " classes; 1 to ",
                                               kClassMax, " are read"));
}

absl::StatusOr<ClassList> ReadClassList(const LogFile& file) {
  LogFile table = file;
  LineReader lines(file.bytes);
  TextLine line;
  IdColumns columns;
  const bool has_line = lines.Next(&line);
  const LinePosition first{file.path, line.number};
  std::vector<std::string_view> fields;
  SplitIds(line.text, CommaOfIds(line.text), &fields);
  const bool has_ids = has_line && (ParseInteger(first, "id", fields[0]).ok() ||
                                    ReadIdHeader(first, line.text, &columns).ok());
  if (has_line && !has_ids) {
    // As a table, with a tab, which names do not have.
    table.bytes = "id\tname\n";
    LineReader names(file.bytes);
    for (int64_t number = 0; names.Next(&line); ++number) {
      absl::StrAppend(&table.bytes, number, "\t", std::string(line.text), "\n");
    }
  }
  ClassList list;
  DSG_ASSIGN_OR_RETURN(list.ids, ReadLabelIds(table));
  for (size_t id = 0; id < LabelIds::kCount; ++id) {
    if (list.ids.is_listed[id]) list.count = id + 1;
  }
  return list;
}

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
