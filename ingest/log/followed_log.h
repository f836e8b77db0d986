// SPDX-License-Identifier: Apache-2.0
// Logs that are read while another program writes them: tables of text, and MCAP files.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/growing_file.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The log of a file that grows. A record counts when it is whole: a line with its end, a record or
/// chunk of MCAP. Next waits for more, and the log ends as FollowOptions say, an MCAP file also
/// with its own end.
///
/// What identifies the log (LogInfo::content_sha256) is its begin only, however much was there when
/// it was opened: of tables the header and the first row, of MCAP what the pipeline gets to know of
/// the first kFollowedBeginNs. Both are waited for.
///
/// Requires: LogOptions::follow.
/// Errors: NOT_FOUND; INVALID_ARGUMENT/FIELD_INVALID for what cannot be followed: standard input,
/// folders, packed files, other bags, scene graphs, pose and loop files; FILE_MALFORMED when the
/// file ends before its first row.
absl::StatusOr<std::unique_ptr<LogSource>> OpenFollowed(const std::string& path,
                                                        const LogOptions& options);

/// Topics and calibration of a followed bag are those of so much of its record times.
inline constexpr TimeNs kFollowedBeginNs = 3 * kNsPerSecond;

/// A table of rows, of a format that IsRowFormat. Rows must be in the order of time, over all
/// agents. Those of the newest stamp wait for one that is later, or a second, so that agents of one
/// instant come by name as they do in a finished file.
absl::StatusOr<std::unique_ptr<LogSource>> OpenFollowedTable(std::unique_ptr<GrowingFile> file,
                                                             const LogOptions& options);

/// An MCAP file (bag_log.cc). Poses come from a topic or from /tf (FollowedTransforms), loop
/// closures from a topic, which may come later than kFollowedBeginNs, or from
/// LogOptions::loop_file. That is read as a whole before, and is part of the log's identity: where
/// a loop closure is told must follow from the files alone, or a run that was cut off could not be
/// continued.
absl::StatusOr<std::unique_ptr<LogSource>> OpenFollowedBag(std::unique_ptr<GrowingFile> file,
                                                           const LogOptions& options);

}  // namespace dsg::ingest
