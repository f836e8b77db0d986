// SPDX-License-Identifier: Apache-2.0
// Loop closures as lines of JSON, as docs/sensor_logs.md describes them.
// Refuses to judge them: a wrong one is read like a right one.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"

namespace dsg::ingest {

/// More than any run of a robot has, and few enough to compare in pairs.
inline constexpr size_t kLoopCountMax = 100'000;

/// Reads one line after the other; notes what it passes over.
class LoopLines {
 public:
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED at `at`, naming the field and the value. A line has at
  /// most 64 KiB.
  absl::StatusOr<LoopMeasurement> Read(const LinePosition& at, std::string_view line);
  /// Reads, and keeps it for TakeChannel. Errors: of Read.
  absl::Status Add(const LinePosition& at, std::string_view line);

  /// The channel "loops0" of those that were kept, ascending by time, then by the other time, then
  /// as they stood. `notes`: of NoteKeys.
  SensorChannel TakeChannel(std::vector<std::string>* notes);
  /// Which keys were unknown so far, and how often.
  void NoteKeys(std::vector<std::string>* notes) const;

 private:
  size_t count_ = 0;
  std::vector<LoopMeasurement> loops_;
  std::map<std::string, int64_t> unknown_keys_;
};

/// Loop closures that wait until both their stamps have been read. Those of one instant come by
/// their stamps, then as they were added.
class LoopQueue {
 public:
  void Add(LoopMeasurement loop);

  bool empty() const { return waiting_.empty(); }
  /// The later stamp of the first one. Requires: not empty.
  TimeNs first_ns() const { return std::get<0>(waiting_.begin()->first); }
  /// Requires: not empty.
  LoopMeasurement Take();

 private:
  /// By the later stamp, LoopMeasurement::time_ns and from_ns.
  std::multimap<std::tuple<TimeNs, TimeNs, TimeNs>, LoopMeasurement> waiting_;
};

/// The loop closures of a log: LogOptions::loop_file if there is one, else `log_path` if it is not
/// empty; nullopt without either. An empty file is a log without loops.
/// Errors: of ReadLogFile and LoopLines::Add.
absl::StatusOr<std::optional<SensorChannel>> ReadLoopChannel(const LogOptions& options,
                                                             const std::string& log_path,
                                                             LogDigest* digest, LogInfo* info);

/// The line that LoopLines reads back to the same numbers.
std::string FormatLoop(const LoopMeasurement& loop);

}  // namespace dsg::ingest
