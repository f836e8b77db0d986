// SPDX-License-Identifier: Apache-2.0
// Logs that hold nothing but the poses of one robot: EuRoC's ground truth and TUM's trajectories.
#include "ingest/log/pose_table.h"
#include "ingest/log/readers.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {

OpenedLog ReadEuroc(const LogFile& file, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(TrackTable table, ReadEurocPoses(file, RobotName(options)));
  LogInfo info = DescribeTextLog("euroc", file);
  info.has_clock = true;
  info.clock = Clock::kUnix;
  DropRepeats(options.is_strict, &table, &info.notes);
  info.channel_counts["poses"] = static_cast<int64_t>(table.rows.size());
  return MakeClockLog(std::move(table), std::nullopt, std::move(info));
}

OpenedLog ReadTum(const LogFile& file, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(TrackTable table, ReadTumPoses(file, RobotName(options)));
  LogInfo info = DescribeTextLog("tum", file);
  DSG_RETURN_IF_ERROR(SetClock(options, &table, &info));
  DropRepeats(options.is_strict, &table, &info.notes);
  info.channel_counts["poses"] = static_cast<int64_t>(table.rows.size());
  return MakeClockLog(std::move(table), std::nullopt, std::move(info));
}

}  // namespace dsg::ingest
