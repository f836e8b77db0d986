// SPDX-License-Identifier: Apache-2.0
// Several sensors' tables as one log: merged by time, each item made when its turn comes.
// Refuses channels whose stamps do not grow: no order could be trusted.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_digest.h"
#include "ingest/log/log_source.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// Who comes first at equal stamps.
enum class ChannelRank { kImu = 0, kPoses = 1, kImages = 2, kDetections = 3, kLoops = 4 };

struct SensorChannel {
  std::string name;
  ChannelRank rank = ChannelRank::kImages;
  /// Ascending.
  std::vector<TimeNs> times;
  /// Makes the item of an index into `times`.
  std::function<absl::StatusOr<Measurement>(size_t)> make;
};

/// Merges the channels; fills in the counts and the first stamp of `info`.
/// Errors: FILE_MALFORMED when there is not one measurement; of CheckSharesTime.
absl::StatusOr<std::unique_ptr<LogSource>> MakeSensorLog(std::vector<SensorChannel> channels,
                                                         const LogOptions& options, LogInfo info);

/// The first stamp and the last.
struct StampSpan {
  TimeNs first_ns = kTimeMax;
  TimeNs last_ns = kTimeMin;

  bool is_empty() const { return last_ns < first_ns; }
  void Add(TimeNs time_ns);
};

/// Checks that the poses of LogOptions::pose_file are of the same time as the sensors of the log at
/// `path`. OK without a pose file, and if one of the spans is empty.
/// Errors: FIELD_INVALID naming both files and both spans.
absl::Status CheckSharesTime(const LogOptions& options, const StampSpan& poses,
                             const std::string& path, const StampSpan& sensors);

/// Errors: FILE_MALFORMED naming line, channel and both stamps when `time_ns` is not after the
/// channel's last one.
absl::Status CheckGrows(const std::string& file, int64_t line, const std::string& channel,
                        const std::vector<TimeNs>& times, TimeNs time_ns);

/// What a log and its user offer of the robot's poses.
struct PoseTables {
  std::optional<TrackTable> ground_truth;
  std::optional<TrackTable> external;
};

/// The robot's name: the prefix, or "body".
std::string RobotName(const LogOptions& options);

/// Reads LogOptions::pose_file over `tables`, if there is one, and takes what LogOptions::poses
/// asks for. Says in `info` which it took.
/// Errors: FIELD_INVALID naming what to give when the log has no such poses.
absl::StatusOr<std::optional<TrackTable>> ChoosePoses(const LogOptions& options, PoseTables tables,
                                                      LogDigest* digest, LogInfo* info);

/// Which of the kinds that a log holds LogOptions::poses takes; ChoosePoses without the tables.
enum class PoseChoice { kNone, kGroundTruth, kExternal };
absl::StatusOr<PoseChoice> ChoosePoseKind(const LogOptions& options, bool has_ground_truth,
                                          bool has_external, const std::string& path);

/// The channel "poses".
SensorChannel MakePoseChannel(TrackTable table);

}  // namespace dsg::ingest
