// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/readers.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Median height of the helmets over the floor, Scenario 5.
constexpr double kHelmetHeightM = 1.81;

struct Columns {
  size_t count = 0;
  size_t time = 0;
  size_t x = 0;
  size_t y = 0;
  size_t z = 0;
  size_t helmet = 0;
  size_t tracklet = 0;
  size_t role = 0;
};

absl::StatusOr<Columns> ReadHeader(const LinePosition& at,
                                   const std::vector<std::string_view>& fields) {
  Columns columns{.count = fields.size()};
  const std::pair<const char*, size_t*> wanted[] = {{"Time", &columns.time},
                                                    {"x", &columns.x},
                                                    {"y", &columns.y},
                                                    {"z", &columns.z},
                                                    {"ag_id", &columns.helmet},
                                                    {"tracklet_id", &columns.tracklet},
                                                    {"data_label", &columns.role}};
  for (const auto& [name, index] : wanted) {
    const auto found = std::find(fields.begin(), fields.end(), name);
    if (found == fields.end()) {
      return at.Error(absl::StrCat("the header has no column \"", name,
                                   "\"; is this a THOR-MAGNI table of tracklets?"));
    }
    *index = static_cast<size_t>(found - fields.begin());
  }
  return columns;
}

absl::StatusOr<int32_t> FindThorAgent(const LinePosition& at, const LogOptions& options,
                                      const Columns& columns,
                                      const std::vector<std::string_view>& fields,
                                      TrackTable* table) {
  const std::string_view helmet = fields[columns.helmet];
  if (helmet.empty()) return at.FieldError("ag_id", helmet, "a name is due; correct the line");
  DSG_ASSIGN_OR_RETURN(const int64_t tracklet,
                       ParseInteger(at, "tracklet_id", fields[columns.tracklet]));
  if (tracklet < 0) {
    return at.FieldError("tracklet_id", fields[columns.tracklet],
                         "ids are integers from 0; correct or remove the line");
  }
  const std::string name = absl::StrCat(options.agent_prefix, std::string(helmet), "/", tracklet);
  return table->FindOrAdd(name, kinds::kHuman);
}

absl::Status AddThorRow(const LinePosition& at, const LogOptions& options, const Columns& columns,
                        const std::vector<std::string_view>& fields, TrackTable* table) {
  DSG_ASSIGN_OR_RETURN(const TimeNs offset, ParseSeconds(at, "Time", fields[columns.time]));
  DSG_ASSIGN_OR_RETURN(const TimeNs time, AddToEpoch(at, options.epoch_ns, offset));
  Eigen::Vector3d position;
  DSG_ASSIGN_OR_RETURN(position.x(), ParseCoordinate(at, "x", fields[columns.x]));
  DSG_ASSIGN_OR_RETURN(position.y(), ParseCoordinate(at, "y", fields[columns.y]));
  DSG_ASSIGN_OR_RETURN(position.z(), ParseCoordinate(at, "z", fields[columns.z]));
  DSG_ASSIGN_OR_RETURN(const int32_t agent, FindThorAgent(at, options, columns, fields, table));
  table->AddPosition(time, at.line, agent, position);
  return absl::OkStatus();
}

using RoleAgents = std::map<std::string, std::set<int32_t>, std::less<>>;

std::string RoleNote(const RoleAgents& agents_of_role) {
  std::vector<std::string> parts;
  for (const auto& [role, agents] : agents_of_role) {
    parts.push_back(absl::StrCat(role, " ", agents.size()));
  }
  return absl::StrCat("roles (data_label) by tracklets: ", absl::StrJoin(parts, ", "),
                      "; roles are not kept");
}

}  // namespace

OpenedLog ReadThor(const LogFile& file, const LogOptions& options) {
  TrackTable table;
  table.file = file.path;
  LineReader lines(file.bytes);
  TextLine line;
  if (!lines.Next(&line)) return LinePosition{file.path, 1}.Error("the header is missing");
  std::vector<std::string_view> fields;
  SplitAtCommas(line.text, &fields);
  DSG_ASSIGN_OR_RETURN(const Columns columns,
                       ReadHeader(LinePosition{file.path, line.number}, fields));
  RoleAgents agents_of_role;
  while (lines.Next(&line)) {
    SplitAtCommas(line.text, &fields);
    const LinePosition at{file.path, line.number};
    DSG_RETURN_IF_ERROR(
        CheckFieldCount(at, line, fields.size(), columns.count, "as in the header"));
    DSG_RETURN_IF_ERROR(AddThorRow(at, options, columns, fields, &table));
    agents_of_role[std::string(fields[columns.role])].insert(table.rows.back().agent);
  }
  LogInfo info = DescribeTextLog("thor", file);
  info.feet_below_m = kHelmetHeightM;
  info.notes.push_back(
      "times restart with each run, so each tracklet is an agent of its own: ag_id/tracklet_id");
  info.notes.push_back(RoleNote(agents_of_role));
  return MakeClockLog(std::move(table), std::nullopt, std::move(info));
}

}  // namespace dsg::ingest
