// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_cat.h"
#include "ingest/log/readers.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::ingest {
namespace {

constexpr char kTracksHeader[] = "time_ns,agent,kind,x,y,z,qx,qy,qz,qw";
constexpr size_t kColumnCount = 10;

absl::Status ShiftTime(const std::string& file, TimeNs epoch_ns, TimeNs* time_ns) {
  if (*time_ns == kTimeMin || *time_ns == kTimeMax) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(*time_ns, AddToEpoch(LinePosition{file, 1}, epoch_ns, *time_ns));
  return absl::OkStatus();
}

absl::Status ShiftTimes(const std::string& file, TimeNs epoch_ns, GraphDelta* world) {
  for (Node& node : world->nodes) {
    DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &node.valid.from_ns));
    DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &node.valid.to_ns));
    if (node.first_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &*node.first_observed_ns));
    }
    if (node.last_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &*node.last_observed_ns));
    }
  }
  for (Edge& edge : world->edges) {
    DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &edge.valid.from_ns));
    DSG_RETURN_IF_ERROR(ShiftTime(file, epoch_ns, &edge.valid.to_ns));
  }
  return absl::OkStatus();
}

absl::StatusOr<GraphMeasurement> ReadWorld(const LogFile& file, const LogOptions& options) {
  absl::StatusOr<GraphDelta> world = DeltaFromJson(file.bytes);
  if (!world.ok()) return Annotate(world.status(), file.path);
  if (!world->appends.empty() || !world->corrections.empty() || !world->stays.empty()) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(file.path, ": holds trajectories or stays; a world has nodes, ",
                                  "edges, mesh and assets only; put poses into tracks.csv"),
                     {{"file", file.path}});
  }
  DSG_RETURN_IF_ERROR(ShiftTimes(file.path, options.epoch_ns, &*world));
  return GraphMeasurement{*std::move(world)};
}

absl::StatusOr<int32_t> FindTracksAgent(const LinePosition& at, const LogOptions& options,
                                        std::string_view name, std::string_view kind,
                                        TrackTable* table) {
  if (name.empty()) return at.FieldError("agent", name, "a name is due; correct the line");
  if (!IsAgentKind(kind)) {
    return at.FieldError(
        "kind", kind, "\"human\", \"robot\", \"vehicle\" or \"animal\" is due; correct the line");
  }
  return table->FindOrAdd(options.agent_prefix + std::string(name), kind);
}

// Four empty fields: the source had no orientation.
absl::Status ReadOrientation(const LinePosition& at, const std::vector<std::string_view>& fields,
                             TrackRow* row) {
  if (fields[6].empty() && fields[7].empty() && fields[8].empty() && fields[9].empty()) {
    row->flags = pose_flags::kNoOrientation;
    return absl::OkStatus();
  }
  double xyzw[4] = {};
  constexpr std::string_view kNames[] = {"qx", "qy", "qz", "qw"};
  for (size_t i = 0; i < 4; ++i) {
    DSG_ASSIGN_OR_RETURN(xyzw[i], ParseNumber(at, kNames[i], fields[6 + i]));
  }
  DSG_ASSIGN_OR_RETURN(row->map_T_agent.orientation,
                       Normalize(at, {xyzw[3], xyzw[0], xyzw[1], xyzw[2]}));
  return absl::OkStatus();
}

absl::Status AddTracksRow(const LogOptions& options, const TextLine& line,
                          const std::vector<std::string_view>& fields, TrackTable* table) {
  const LinePosition at{table->file, line.number};
  DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), kColumnCount, kTracksHeader));
  TrackRow row;
  row.line = line.number;
  DSG_ASSIGN_OR_RETURN(const int64_t offset, ParseInteger(at, "time_ns", fields[0]));
  DSG_ASSIGN_OR_RETURN(row.time_ns, AddToEpoch(at, options.epoch_ns, offset));
  DSG_ASSIGN_OR_RETURN(row.agent, FindTracksAgent(at, options, fields[1], fields[2], table));
  constexpr std::string_view kNames[] = {"x", "y", "z"};
  for (size_t i = 0; i < 3; ++i) {
    DSG_ASSIGN_OR_RETURN(row.map_T_agent.position[static_cast<Eigen::Index>(i)],
                         ParseCoordinate(at, kNames[i], fields[3 + i]));
  }
  DSG_RETURN_IF_ERROR(ReadOrientation(at, fields, &row));
  table->rows.push_back(row);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TextRows> ReadTracksRows(const LogFile& file, const LogOptions& options) {
  TextRows rows{.clock = RowClock::kMap};
  rows.table.file = file.path;
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  if (!lines.Next(&line) || line.text != kTracksHeader) {
    return LinePosition{file.path, 1}.FieldError("header", line.text,
                                                 absl::StrCat("\"", kTracksHeader, "\" is due"));
  }
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    SplitAtCommas(line.text, &fields);
    DSG_RETURN_IF_ERROR(AddTracksRow(options, line, fields, &rows.table));
  }
  return rows;
}

OpenedLog ReadTracks(const std::optional<LogFile>& world, const LogFile& tracks,
                     const LogOptions& options) {
  LogInfo info = DescribeTextLog("dsg-tracks", tracks);
  std::optional<GraphMeasurement> graph;
  if (world.has_value()) {
    DSG_ASSIGN_OR_RETURN(graph, ReadWorld(*world, options));
    info.content_sha256 = ContentSha256({&*world, &tracks});
  } else {
    info.notes.push_back("there is no map.json beside tracks.csv: rooms and places are the map's");
  }
  DSG_ASSIGN_OR_RETURN(TextRows rows, ReadTracksRows(tracks, options));
  return MakeClockLog(std::move(rows.table), std::move(graph), std::move(info));
}

}  // namespace dsg::ingest
