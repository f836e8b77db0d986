// SPDX-License-Identifier: Apache-2.0
// Logs that hold nothing but the poses of one robot: EuRoC's ground truth and TUM's trajectories.
#include "ingest/log/pose_table.h"
#include "ingest/log/readers.h"
#include "ingest/log/sensor_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::StatusOr<TextRows> ReadEurocRows(const LogFile& file, const LogOptions& options) {
  TextRows rows{.clock = RowClock::kUnix, .is_robot = true, .is_of_one = true, .may_repeat = true};
  DSG_ASSIGN_OR_RETURN(rows.table, ReadEurocPoses(file, RobotName(options)));
  return rows;
}

absl::StatusOr<TextRows> ReadTumRows(const LogFile& file, const LogOptions& options) {
  TextRows rows{.clock = RowClock::kAny, .is_robot = true, .is_of_one = true, .may_repeat = true};
  DSG_ASSIGN_OR_RETURN(rows.table, ReadTumPoses(file, RobotName(options)));
  return rows;
}

}  // namespace dsg::ingest
