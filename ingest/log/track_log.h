// SPDX-License-Identifier: Apache-2.0
// Tracks of a log in memory: checked in the order of the file, handed out in the order of time.
// Refuses logs in which an agent's time repeats or steps back, since no order could be trusted.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// One row of a track log.
struct TrackRow {
  /// Nanoseconds; while a reader without a clock collects rows, the frame number.
  TimeNs time_ns = 0;
  int64_t line = 0;
  /// Index into TrackTable::names.
  int32_t agent = 0;
  uint32_t flags = 0;
  Pose3d map_T_agent;
};

/// All rows of a log, in the order of the file.
struct TrackTable {
  struct Agent {
    std::string name;
    std::string kind;
  };

  /// The index of an agent, new or known. Name and kind together identify it.
  int32_t FindOrAdd(std::string_view name, std::string_view kind);
  /// A position without orientation.
  void AddPosition(TimeNs time_ns, int64_t line, int32_t agent, const Eigen::Vector3d& position);

  std::string file;
  std::vector<Agent> agents;
  std::vector<TrackRow> rows;

 private:
  absl::flat_hash_map<std::string, int32_t> index_;
};

/// Each takes some 5 kB until the log is read.
inline constexpr size_t kAgentsOfLogMax = 100'000;

/// Errors: FILE_MALFORMED when the log has no row, or more agents than kAgentsOfLogMax.
absl::Status CheckRows(const TrackTable& table);

/// Times strictly grow per agent. `unit` is what a reader's times are: "time" or "frame".
/// Errors: FILE_MALFORMED naming file, line, agent, both times and what to do.
absl::Status CheckOrder(const TrackTable& table, std::string_view unit);

/// Removes rows that give an agent a second position at a stamp, if they are at most one of a
/// hundred rows: motion capture and recorders do that now and then. The first one stays; `notes`
/// says how many went. With `is_strict`, nothing. For CheckOrder to judge what is left.
void DropRepeats(bool is_strict, TrackTable* table, std::vector<std::string>* notes);

/// Rows whose stamps may be of any clock: from 2001-09-09 on they are Unix time, before they count
/// from the epoch of the map, which is added to them. Says in `info` which.
/// Errors: FILE_MALFORMED naming the line when a sum does not fit in 64 bits.
absl::Status SetClock(const LogOptions& options, TrackTable* table, LogInfo* info);

/// A log that yields `graph` (if any), then the rows by time and agent name. Fills in what
/// `info` has of counts and first stamp. Requires: CheckOrder holds for nanoseconds.
std::unique_ptr<LogSource> MakeTrackLog(TrackTable table, std::optional<GraphMeasurement> graph,
                                        LogInfo info);

/// Checks rows that carry nanoseconds, and makes the log.
absl::StatusOr<std::unique_ptr<LogSource>> MakeClockLog(TrackTable table,
                                                        std::optional<GraphMeasurement> graph,
                                                        LogInfo info);

}  // namespace dsg::ingest
