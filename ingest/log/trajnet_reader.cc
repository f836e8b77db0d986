// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_cat.h"
#include "ingest/log/readers.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status AddTrajnetRow(const LogOptions& options, const TextLine& line,
                           const std::vector<std::string_view>& fields, TrackTable* table) {
  const LinePosition at{table->file, line.number};
  DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 4, "frame person x y"));
  DSG_ASSIGN_OR_RETURN(const int64_t frame, ParseFrame(at, fields[0]));
  DSG_ASSIGN_OR_RETURN(const std::string person, ParsePersonName(at, fields[1]));
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  DSG_ASSIGN_OR_RETURN(position.x(), ParseCoordinate(at, "x", fields[2]));
  DSG_ASSIGN_OR_RETURN(position.y(), ParseCoordinate(at, "y", fields[3]));
  const int32_t agent = table->FindOrAdd(options.agent_prefix + person, kinds::kHuman);
  table->AddPosition(frame, line.number, agent, position);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TextRows> ReadTrajnetRows(const LogFile& file, const LogOptions& options) {
  TextRows rows{.clock = RowClock::kFrames};
  rows.table.file = file.path;
  LineReader lines(file.bytes, file.lines_left_out);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    SplitAtBlanks(line.text, &fields);
    DSG_RETURN_IF_ERROR(AddTrajnetRow(options, line, fields, &rows.table));
  }
  return rows;
}

}  // namespace dsg::ingest
