// SPDX-License-Identifier: Apache-2.0
// One log into one map: names agents, derives stays, cuts deltas, commits what is news.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "ingest/commit/delta_sink.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/log_mapper.h"
#include "ingest/pipeline/person_mapper.h"
#include "ingest/pipeline/robot_model.h"
#include "ingest/pipeline/robot_told.h"

namespace dsg::ingest {

struct IngestOptions {
  /// A delta is closed after so many poses; the last one when the log ends.
  int64_t poses_per_delta = 5000;
  /// Who commits, for the record of revisions.
  std::string author = "dsg-ingest";
  /// How the log was turned (TurnUpright); part of what deltas depend on.
  std::string up = "auto";
  /// Of logs with depth: static layers, committed while the log runs.
  MappingOptions mapping;
  /// Of logs with detections of people: their tracks.
  PeopleOptions people;
  /// Of logs with sensors: keyframes, odometry and loop closures of the robot.
  RobotGraphOptions robot_graph;
  /// The robot's shape; unset = unknown.
  std::optional<RobotModel> robot_model;
  /// Deltas must fit into messages to a server; a large correction then takes several revisions.
  bool is_size_bounded = false;

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID.
  absl::Status Validate() const;
};

struct PeopleSummary {
  PeopleCounts counts;
  std::map<std::string, StageClock::Time> stages;
};

struct IngestSummary {
  /// Agents that the log speaks of.
  int64_t agent_count = 0;
  CommitCounts committed;
  /// Measurements that were read and not used, by channel.
  std::map<std::string, int64_t> unused;
  /// Unset when the log has no depth, or mapping is off.
  std::optional<MappingSummary> mapping;
  /// Unset when the log has no detections, or people are off.
  std::optional<PeopleSummary> people;
  /// Unset when the log has no loop closures.
  std::optional<LoopCounts> loops;
  /// Poses and graphs with content that the log gave, whether or not the map had them.
  int64_t given_count = 0;
  /// An earlier run has committed a part of the log, or all of it.
  bool was_known = false;
};

/// Reads `log` to its end. The same log, options and starting map give byte-equal deltas. A run
/// that was cut off is continued by running it again; a log that the map holds adds nothing.
/// `on_progress` (may be empty) gets the count of measurements read so far.
///
/// `log_options`: what the log was opened with.
/// Errors: of the log, and of DeltaSink::Put. What is committed by then stays, and counts.
absl::StatusOr<IngestSummary> IngestLog(LogSource& log, const LogOptions& log_options,
                                        const IngestOptions& options, const MapView& map,
                                        GraphWriter& writer,
                                        const std::function<void(int64_t)>& on_progress);

}  // namespace dsg::ingest
