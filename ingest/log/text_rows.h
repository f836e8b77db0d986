// SPDX-License-Identifier: Apache-2.0
// The rows of a text table, of any format, before a log is made of them: for logs that are read
// whole, and for those that are read while they grow.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/log_source.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// What TrackRow::time_ns is as a reader leaves it.
enum class RowClock {
  /// Nanoseconds since 1970.
  kUnix,
  /// Nanoseconds of the map, its epoch added.
  kMap,
  /// Nanoseconds, for SetClock to tell of which clock.
  kAny,
  /// Frame numbers.
  kFrames,
};

struct TextRows {
  TrackTable table;
  RowClock clock = RowClock::kAny;
  /// Poses of one robot, which sensors may go with.
  bool is_robot = false;
  /// Rows do not say of whom they are.
  bool is_of_one = false;
  /// One row in a hundred may repeat a stamp (DropRepeats).
  bool may_repeat = false;
  std::vector<std::string> notes;
};

/// "obsmat", "trajnet", "trajnet-ndjson", "euroc", "tum", "csv", "dsg-tracks".
bool IsRowFormat(std::string_view format);

/// The rows of some lines. Lines that LogFile::lines_left_out leaves out keep their numbers.
/// Requires: IsRowFormat.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field, value and what to do.
absl::StatusOr<TextRows> ReadTextRows(std::string_view format, const LogFile& file,
                                      const LogOptions& options);

/// The log that these are all rows of. Errors: of MakeFrameLog and MakeClockLog.
absl::StatusOr<std::unique_ptr<LogSource>> MakeTextLog(std::string_view format, TextRows rows,
                                                       const LogFile& file,
                                                       const LogOptions& options);

}  // namespace dsg::ingest
