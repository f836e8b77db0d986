// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/pose_table.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "ingest/log/rigid_matrix.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kMatrixFields = 12;
constexpr char kPoseColumns[] = "timestamp, p x y z, q w x y z, then nothing or v, b_w, b_a";

// A header that names other columns must not be read as if it named ours.
absl::Status CheckHeader(const LinePosition& at, const std::vector<std::string_view>& fields) {
  constexpr std::string_view kMarks[] = {"timestamp", "_x", "_y", "_z", "_w", "_x", "_y", "_z"};
  if (fields.size() != 8 && fields.size() != 17) {
    return at.Error(absl::StrCat("the header names ", fields.size(), " columns, expected 8 or 17 (",
                                 kPoseColumns, "); is this a state_groundtruth_estimate0?"));
  }
  for (size_t i = 0; i < std::size(kMarks); ++i) {
    const bool is_group_right = i == 0 || fields[i].starts_with(i < 4 ? "p_" : "q_");
    if (!is_group_right || fields[i].find(kMarks[i]) == std::string_view::npos) {
      return at.FieldError("header", fields[i],
                           absl::StrCat("columns must be ", kPoseColumns,
                                        "; is this a state_groundtruth_estimate0?"));
    }
  }
  return absl::OkStatus();
}

absl::Status AddPoseRow(const LinePosition& at, const std::vector<std::string_view>& fields,
                        int32_t agent, TrackTable* table) {
  DSG_ASSIGN_OR_RETURN(const int64_t stamp, ParseInteger(at, "timestamp", fields[0]));
  if (stamp == kTimeMax || stamp == kTimeMin) {
    return at.FieldError("timestamp", fields[0], "nanoseconds since 1970 are due");
  }
  Pose3d map_T_body;
  constexpr std::string_view kPosition[] = {"p_x", "p_y", "p_z"};
  for (size_t i = 0; i < 3; ++i) {
    DSG_ASSIGN_OR_RETURN(map_T_body.position[static_cast<Eigen::Index>(i)],
                         ParseCoordinate(at, kPosition[i], fields[1 + i]));
  }
  double wxyz[4] = {};
  constexpr std::string_view kOrientation[] = {"q_w", "q_x", "q_y", "q_z"};
  for (size_t i = 0; i < 4; ++i) {
    DSG_ASSIGN_OR_RETURN(wxyz[i], ParseNumber(at, kOrientation[i], fields[4 + i]));
  }
  for (size_t i = 8; i < fields.size(); ++i) {
    DSG_RETURN_IF_ERROR(ParseNumber(at, absl::StrCat("column ", i + 1), fields[i]).status());
  }
  DSG_ASSIGN_OR_RETURN(map_T_body.orientation, Normalize(at, {wxyz[0], wxyz[1], wxyz[2], wxyz[3]}));
  table->rows.push_back(
      {.time_ns = stamp, .line = at.line, .agent = agent, .flags = 0, .map_T_agent = map_T_body});
  return absl::OkStatus();
}

absl::Status AddTumRow(const LinePosition& at, const std::vector<std::string_view>& fields,
                       int32_t agent, TrackTable* table) {
  DSG_ASSIGN_OR_RETURN(const TimeNs stamp, ParseSeconds(at, "timestamp", fields[0]));
  Pose3d map_T_body;
  constexpr std::string_view kNames[] = {"x", "y", "z", "qx", "qy", "qz", "qw"};
  double values[7] = {};
  for (size_t i = 0; i < 7; ++i) {
    DSG_ASSIGN_OR_RETURN(values[i], i < 3 ? ParseCoordinate(at, kNames[i], fields[1 + i])
                                          : ParseNumber(at, kNames[i], fields[1 + i]));
  }
  map_T_body.position = {values[0], values[1], values[2]};
  DSG_ASSIGN_OR_RETURN(map_T_body.orientation,
                       Normalize(at, {values[6], values[3], values[4], values[5]}));
  table->rows.push_back(
      {.time_ns = stamp, .line = at.line, .agent = agent, .flags = 0, .map_T_agent = map_T_body});
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TrackTable> ReadEurocPoses(const LogFile& file, const std::string& robot_name) {
  TrackTable table;
  table.file = file.path;
  const int32_t agent = table.FindOrAdd(robot_name, kinds::kRobot);
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  std::vector<std::string_view> fields;
  size_t column_count = 0;
  while (lines.Next(&line)) {
    const LinePosition at{file.path, line.number};
    const bool is_header = line.text.starts_with('#');
    SplitAtCommas(is_header ? line.text.substr(1) : line.text, &fields);
    if (is_header) {
      DSG_RETURN_IF_ERROR(CheckHeader(at, fields));
      column_count = fields.size();
      continue;
    }
    if (column_count == 0) column_count = fields.size() == 8 ? 8 : 17;
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), column_count, kPoseColumns));
    DSG_RETURN_IF_ERROR(AddPoseRow(at, fields, agent, &table));
  }
  return table;
}

absl::StatusOr<TrackTable> ReadTumPoses(const LogFile& file, const std::string& robot_name) {
  TrackTable table;
  table.file = file.path;
  const int32_t agent = table.FindOrAdd(robot_name, kinds::kRobot);
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{file.path, line.number};
    SplitAtBlanks(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 8, "timestamp x y z qx qy qz qw"));
    DSG_RETURN_IF_ERROR(AddTumRow(at, fields, agent, &table));
  }
  return table;
}

absl::StatusOr<TrackTable> ReadPoseTable(const LogFile& file, const std::string& robot_name) {
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    return line.text.find(',') == std::string_view::npos ? ReadTumPoses(file, robot_name)
                                                         : ReadEurocPoses(file, robot_name);
  }
  return LinePosition{file.path, 1}.Error(
      "holds no pose; EuRoC or TUM columns are due, one pose a line");
}

absl::StatusOr<Pose3d> ReadMatrixFields(const LinePosition& at,
                                        const std::vector<std::string_view>& fields, size_t first,
                                        double* deviation_max) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (size_t i = 0; i < kMatrixFields; ++i) {
    DSG_ASSIGN_OR_RETURN(matrix(i / 4, i % 4),
                         ParseNumber(at, absl::StrCat("number ", i + 1), fields[first + i]));
  }
  const absl::StatusOr<RigidMatrix> rigid = ToRigid(matrix);
  if (!rigid.ok()) return at.Error(std::string(rigid.status().message()));
  *deviation_max = std::max(*deviation_max, rigid->deviation);
  return rigid->pose;
}

absl::StatusOr<MatrixPoses> ReadMatrixPoses(const LogFile& file) {
  MatrixPoses poses;
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{file.path, line.number};
    SplitAtBlanks(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), kMatrixFields, "a 3x4 matrix"));
    DSG_ASSIGN_OR_RETURN(const Pose3d map_T_body,
                         ReadMatrixFields(at, fields, 0, &poses.deviation_max));
    poses.rows.push_back({line.number, map_T_body});
  }
  return poses;
}

bool HasMatrixRows(const LogFile& file) {
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    SplitAtBlanks(line.text, &fields);
    return fields.size() == kMatrixFields;
  }
  return false;
}

}  // namespace dsg::ingest
