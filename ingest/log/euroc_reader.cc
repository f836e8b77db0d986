// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/pose_table.h"
#include "ingest/log/readers.h"
#include "ingest/log/sensor_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {

OpenedLog ReadEuroc(const LogFile& file, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(TrackTable table, ReadEurocPoses(file, RobotName(options)));
  LogInfo info = DescribeTextLog("euroc", file);
  info.has_clock = true;
  info.clock = Clock::kUnix;
  info.channel_counts["poses"] = static_cast<int64_t>(table.rows.size());
  return MakeClockLog(std::move(table), std::nullopt, std::move(info));
}

}  // namespace dsg::ingest
