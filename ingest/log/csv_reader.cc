// SPDX-License-Identifier: Apache-2.0
// Tables of poses whose header names the columns, whoever wrote them.
#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/readers.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::ingest {
namespace {

// What a column may mean, and the names that it goes by.
enum Column { kTime, kId, kName, kKind, kX, kY, kZ, kQx, kQy, kQz, kQw, kColumnCount };
constexpr std::string_view kShownNames[kColumnCount] = {
    "time", "id", "agent_name", "kind", "x", "y", "z", "qx", "qy", "qz", "qw"};
struct Alias {
  std::string_view name;
  Column column;
};
constexpr Alias kAliases[] = {{"time", kTime},
                              {"t", kTime},
                              {"timestamp", kTime},
                              {"stamp", kTime},
                              {"id", kId},
                              {"agent", kId},
                              {"agent_id", kId},
                              {"person", kId},
                              {"person_id", kId},
                              {"ped_id", kId},
                              {"track", kId},
                              {"track_id", kId},
                              {"object_id", kId},
                              {"name", kId},
                              {"kind", kKind},
                              {"agent_name", kName},
                              {"agent_kind", kKind},
                              {"x", kX},
                              {"tx", kX},
                              {"px", kX},
                              {"p_x", kX},
                              {"pos_x", kX},
                              {"position_x", kX},
                              {"y", kY},
                              {"ty", kY},
                              {"py", kY},
                              {"p_y", kY},
                              {"pos_y", kY},
                              {"position_y", kY},
                              {"z", kZ},
                              {"tz", kZ},
                              {"pz", kZ},
                              {"p_z", kZ},
                              {"pos_z", kZ},
                              {"position_z", kZ},
                              {"qx", kQx},
                              {"q_x", kQx},
                              {"orientation_x", kQx},
                              {"qy", kQy},
                              {"q_y", kQy},
                              {"orientation_y", kQy},
                              {"qz", kQz},
                              {"q_z", kQz},
                              {"orientation_z", kQz},
                              {"qw", kQw},
                              {"q_w", kQw},
                              {"orientation_w", kQw}};

struct Unit {
  std::string_view name;
  /// Of ten, to seconds.
  int power;
};
constexpr Unit kTimeUnits[] = {{"s", 0},   {"sec", 0}, {"seconds", 0},
                               {"ms", -3}, {"us", -6}, {"ns", -9}};

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

struct Header {
  char comma = ',';
  size_t field_count = 0;
  /// The field of each column.
  std::array<std::optional<size_t>, kColumnCount> field;
  int time_power = 0;
  std::vector<std::string> unknown;

  bool Has(Column column) const { return field[column].has_value(); }
};

absl::Status SplitRow(const LinePosition& at, std::string_view line, char comma,
                      std::deque<std::string>* unquoted, std::vector<std::string_view>* fields) {
  if (SplitCsv(line, comma, unquoted, fields)) return absl::OkStatus();
  return at.Error(
      "a field in quotes does not end, or has text behind them; quotes that are part of a field "
      "stand twice, and a field ends in its line");
}

// "Timestamp [ns]", "time_ns" and "x (m)": the name, and the unit if there is one.
std::pair<std::string, std::string> NameAndUnit(std::string_view text) {
  std::string name = absl::AsciiStrToLower(absl::string_view(text.data(), text.size()));
  std::string unit;
  const size_t bracket = name.find_first_of("[(");
  if (bracket != std::string::npos && (name.back() == ']' || name.back() == ')')) {
    unit = name.substr(bracket + 1, name.size() - bracket - 2);
    name.resize(bracket);
    while (name.ends_with(' ') || name.ends_with('_')) name.pop_back();
    return {name, unit};
  }
  const size_t underscore = name.rfind('_');
  if (underscore == std::string::npos) return {name, ""};
  const std::string last = name.substr(underscore + 1);
  const bool is_unit = last == "m" || std::any_of(std::begin(kTimeUnits), std::end(kTimeUnits),
                                                  [&](const Unit& u) { return u.name == last; });
  if (!is_unit) return {name, ""};
  return {name.substr(0, underscore), last};
}

std::optional<Column> FindColumn(std::string_view name) {
  for (const Alias& alias : kAliases) {
    if (alias.name == name) return alias.column;
  }
  return std::nullopt;
}

// Spreadsheets begin with a mark of the encoding, programs with one of a remark.
std::string_view HeaderNames(std::string_view line) {
  if (line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  if (line.starts_with('#')) line.remove_prefix(1);
  return line;
}

char CommaOf(std::string_view line) {
  for (const char comma : {',', ';', '\t'}) {
    if (line.find(comma) != std::string_view::npos) return comma;
  }
  return ',';
}

absl::Status SetUnit(const LinePosition& at, Column column, std::string_view text,
                     const std::string& unit, Header* header) {
  if (unit.empty()) return absl::OkStatus();
  if (column == kTime) {
    for (const Unit& known : kTimeUnits) {
      if (known.name != unit) continue;
      header->time_power = known.power;
      return absl::OkStatus();
    }
    return at.FieldError("header", text, "times are in s, ms, us or ns; convert the column");
  }
  const bool is_length = column >= kX && column <= kZ;
  if (is_length && (unit == "m" || unit == "metres" || unit == "meters")) return absl::OkStatus();
  if (!is_length && (unit == "1" || unit == "-")) return absl::OkStatus();
  return at.FieldError("header", text,
                       absl::StrCat("column ", std::string(kShownNames[column]), " is in ",
                                    is_length ? "metres" : "no unit", "; convert it"));
}

absl::StatusOr<Header> ReadColumns(const LinePosition& at, std::string_view line) {
  line = HeaderNames(line);
  Header header;
  header.comma = CommaOf(line);
  std::deque<std::string> unquoted;
  std::vector<std::string_view> fields;
  DSG_RETURN_IF_ERROR(SplitRow(at, line, header.comma, &unquoted, &fields));
  header.field_count = fields.size();
  for (size_t i = 0; i < fields.size(); ++i) {
    const std::string_view text = fields[i];
    const auto [name, unit] = NameAndUnit(text);
    const std::optional<Column> column = FindColumn(name);
    if (!column.has_value()) {
      header.unknown.emplace_back(text);
      continue;
    }
    if (header.Has(*column)) {
      return at.FieldError("header", text,
                           absl::StrCat("a second column of ", std::string(kShownNames[*column]),
                                        "; remove or rename one"));
    }
    header.field[*column] = i;
    DSG_RETURN_IF_ERROR(SetUnit(at, *column, text, unit, &header));
  }
  for (const Column due : {kTime, kX, kY}) {
    if (header.Has(due)) continue;
    return at.FieldError("header", line,
                         absl::StrCat("no column ", std::string(kShownNames[due]),
                                      "; a table of poses has time, x, y and perhaps id, "
                                      "agent_name, kind, z, qx, qy, qz, qw"));
  }
  int q_count = 0;
  for (const Column q : {kQx, kQy, kQz, kQw}) q_count += header.Has(q) ? 1 : 0;
  if (q_count == 0 || q_count == 4) return header;
  return at.FieldError("header", line, "qx, qy, qz and qw go together; add what is missing");
}

// The rows of one table, with the header's columns.
class RowReader {
 public:
  RowReader(const Header& header, const LogOptions& options, TrackTable* table)
      : header_(header), options_(options), table_(table) {}

  absl::Status Add(const LinePosition& at, const std::vector<std::string_view>& fields) {
    TrackRow row;
    row.line = at.line;
    DSG_ASSIGN_OR_RETURN(row.time_ns,
                         ParseSeconds(at, "time", Field(fields, kTime), header_.time_power));
    DSG_ASSIGN_OR_RETURN(row.agent, FindAgent(at, fields));
    for (const Column axis : {kX, kY, kZ}) {
      if (!header_.Has(axis)) continue;
      DSG_ASSIGN_OR_RETURN(row.map_T_agent.position[axis - kX],
                           ParseCoordinate(at, kShownNames[axis], Field(fields, axis)));
    }
    DSG_RETURN_IF_ERROR(SetOrientation(at, fields, &row));
    table_->rows.push_back(row);
    return absl::OkStatus();
  }

  // Whether several ids are one agent: an agent goes by its name, in a log and across logs.
  void AddNotes(std::vector<std::string>* notes) const {
    constexpr size_t kNamedMax = 5;
    for (const auto& [name, ids] : ids_of_) {
      if (ids.size() < 2) continue;
      if (notes->size() == kNamedMax) return notes->push_back("and more such names");
      notes->push_back(absl::StrCat("\"", absl::Utf8SafeCHexEscape(name), "\" is one agent, of ",
                                    ids.size(), " ids, ", absl::Utf8SafeCHexEscape(*ids.begin()),
                                    " among them"));
    }
  }

 private:
  std::string_view Field(const std::vector<std::string_view>& fields, Column column) const {
    return fields[*header_.field[column]];
  }

  absl::StatusOr<int32_t> FindAgent(const LinePosition& at,
                                    const std::vector<std::string_view>& fields) {
    std::string_view kind = header_.Has(kId) ? kinds::kHuman : kinds::kRobot;
    if (header_.Has(kKind)) {
      kind = Field(fields, kKind);
      if (!IsAgentKind(kind)) {
        return at.FieldError(
            "kind", kind,
            "\"human\", \"robot\", \"vehicle\" or \"animal\" is due; correct the line");
      }
    }
    if (!header_.Has(kId)) return table_->FindOrAdd(RobotName(options_), kind);
    const std::string_view id = Field(fields, kId);
    if (id.empty() || !IsUtf8(id)) {
      return at.FieldError("id", id, "a name or number in UTF-8 is due; correct the line");
    }
    std::string_view name = header_.Has(kName) ? Field(fields, kName) : id;
    if (name.empty()) name = id;
    if (!IsUtf8(name)) {
      return at.FieldError("agent_name", name, "a name in UTF-8 is due; correct the line");
    }
    if (header_.Has(kName)) ids_of_[std::string(name)].emplace(id);
    return table_->FindOrAdd(options_.agent_prefix + std::string(name), kind);
  }

  // Four empty fields: no orientation.
  absl::Status SetOrientation(const LinePosition& at, const std::vector<std::string_view>& fields,
                              TrackRow* row) const {
    row->flags = pose_flags::kNoOrientation;
    if (!header_.Has(kQx)) return absl::OkStatus();
    double xyzw[4] = {};
    bool is_empty = true;
    for (int i = 0; i < 4; ++i) {
      is_empty &= Field(fields, static_cast<Column>(kQx + i)).empty();
    }
    if (is_empty) return absl::OkStatus();
    for (int i = 0; i < 4; ++i) {
      const auto column = static_cast<Column>(kQx + i);
      DSG_ASSIGN_OR_RETURN(xyzw[i], ParseNumber(at, kShownNames[column], Field(fields, column)));
    }
    DSG_ASSIGN_OR_RETURN(row->map_T_agent.orientation,
                         Normalize(at, {xyzw[3], xyzw[0], xyzw[1], xyzw[2]}));
    row->flags = 0;
    return absl::OkStatus();
  }

  const Header& header_;
  const LogOptions& options_;
  TrackTable* table_;
  // Of agents by name, where names stand beside ids.
  std::map<std::string, std::set<std::string>> ids_of_;
};

void AddHeaderNotes(const Header& header, std::vector<std::string>* notes) {
  if (header.Has(kId) && !header.Has(kKind)) {
    notes->push_back("there is no column \"kind\": all agents are people");
  }
  if (!header.Has(kZ)) notes->push_back("there is no column \"z\": all positions have z = 0");
  if (header.unknown.empty()) return;
  constexpr size_t kNamedMax = 20;
  std::vector<std::string> named;
  for (const std::string& name : header.unknown) {
    if (named.size() == kNamedMax) {
      named.push_back(absl::StrCat("and ", header.unknown.size() - kNamedMax, " more"));
      break;
    }
    named.push_back(absl::StrCat("\"", absl::Utf8SafeCHexEscape(name.substr(0, 40)), "\""));
  }
  notes->push_back(absl::StrCat("columns that are not read: ", absl::StrJoin(named, ", ")));
}

}  // namespace

// What is wrong with units or single columns is for the reader to say.
bool IsCsvHeader(std::string_view line) {
  std::deque<std::string> unquoted;
  std::vector<std::string_view> fields;
  std::array<bool, kColumnCount> has = {};
  const std::string_view names = HeaderNames(line);
  SplitCsv(names, CommaOf(names), &unquoted, &fields);
  for (const std::string_view field : fields) {
    const std::optional<Column> column = FindColumn(NameAndUnit(field).first);
    if (column.has_value()) has[*column] = true;
  }
  return has[kTime] && has[kX] && has[kY];
}

absl::StatusOr<TextRows> ReadCsvRows(const LogFile& file, const LogOptions& options) {
  TextRows found{.clock = RowClock::kAny, .may_repeat = true};
  found.table.file = file.path;
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  if (!lines.Next(&line)) return LinePosition{file.path, 1}.Error("the header is missing");
  DSG_ASSIGN_OR_RETURN(const Header header,
                       ReadColumns(LinePosition{file.path, line.number}, line.text));
  found.is_of_one = !header.Has(kId);
  RowReader rows(header, options, &found.table);
  std::deque<std::string> unquoted;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{file.path, line.number};
    DSG_RETURN_IF_ERROR(SplitRow(at, line.text, header.comma, &unquoted, &fields));
    DSG_RETURN_IF_ERROR(
        CheckFieldCount(at, line, fields.size(), header.field_count, "as in the header"));
    DSG_RETURN_IF_ERROR(rows.Add(at, fields));
  }
  rows.AddNotes(&found.notes);
  AddHeaderNotes(header, &found.notes);
  return found;
}

}  // namespace dsg::ingest
