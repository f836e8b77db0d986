// SPDX-License-Identifier: Apache-2.0
// One log into one map: names agents, derives stays, cuts deltas, commits what is news.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/commit/delta_sink.h"
#include "ingest/correction/loop_closer.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/delta_builder.h"
#include "ingest/pipeline/mapping_options.h"
#include "ingest/pipeline/people_options.h"
#include "ingest/pipeline/robot_model.h"
#include "ingest/pipeline/stage_clock.h"
#include "ingest/pipeline/upright.h"
#include "ingest/presence/region_index.h"
#include "ingest/volume/semantic_volume.h"

namespace dsg::ingest {

struct RunPlan;

struct IngestOptions {
  /// A delta is closed after so many poses; the last one when the log ends.
  int64_t poses_per_delta = 5000;
  /// Who commits, for the record of revisions.
  std::string author = "dsg-ingest";
  /// How the log was turned (TurnUpright); part of what deltas depend on.
  std::string up = "auto";
  /// Where the log's frame is in the map (MoveLog), as it was given; empty = it is the map's.
  std::string transform;
  /// Of logs with depth: static layers, committed while the log runs.
  MappingOptions mapping;
  /// Of logs with detections of people: their tracks.
  PeopleOptions people;
  /// Of logs with sensors: keyframes, odometry and loop closures of the robot.
  RobotGraphOptions robot_graph;
  /// The robot's shape; unset = unknown.
  std::optional<RobotModel> robot_model;
  AgentBodyOptions bodies;
  /// Where the robot was between poses.
  PathOptions path;
  /// Of a followed log with sensors: the robot's poses are committed as they come, but for those
  /// less than this after the last ones that were; what is made of pictures goes by
  /// MappingOptions::commit_period_ns.
  TimeNs follow_pose_period_ns = kNsPerSecond / 10;
  /// How TurnUpright has looked for it.
  UprightOptions upright;
  /// Of stays.
  RegionOptions regions;
  /// Where the run keeps on disk what it will not need for long (SpillFile): voxel blocks out of
  /// sight, poses, tracks of people who have left. Empty = TMPDIR, or /tmp.
  std::string spill_folder;
  /// Opens the log once more, as it was opened for IngestLog but for poses, which are not read
  /// then: for MappingOptions::fuses_again. Empty = it cannot be read twice.
  std::function<absl::StatusOr<std::unique_ptr<LogSource>>()> open_again;
  /// Told of what takes long at the end of a log: what it is, and how much of it is done. May be
  /// empty.
  TellWork on_work;
  /// Deltas must fit into messages to a server; a large correction then takes several revisions.
  bool is_size_bounded = false;
  /// What a revert has undone of the log is told again; otherwise such a log is refused.
  bool tells_undone_again = false;

  /// All numbers besides those of mapping and people, for flags.
  std::vector<OptionGroup> Groups();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID.
  absl::Status Validate() const;
};

/// What became of a log's frames, for the user.
struct MappingSummary {
  /// A sentence about what was in the map already; empty when there is nothing to say.
  std::string note;
  VolumeCounts volume;
  SkipCounts skipped;
  std::map<std::string, StageClock::Time> stages;
};

/// What became of a log's detections, for the user.
struct PeopleCounts {
  int64_t detection_count = 0;
  /// Detections with vertices, and those of them that the log has no faces for.
  int64_t body_count = 0;
  int64_t faceless_body_count = 0;
  /// Observations that the tracker took.
  int64_t used_count = 0;
  /// Detections that were left out, by reason in words.
  std::map<std::string, int64_t> rejected;
  /// Believed ones, then those too short to believe.
  int64_t track_count = 0;
  int64_t dropped_track_count = 0;
  int64_t same_as_count = 0;
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
  /// Agents whose name reads as the id of another one.
  std::map<std::string, NodeId> misleading_names;
  /// Unset when the log has no depth, or mapping is off.
  std::optional<MappingSummary> mapping;
  /// Unset when the log has no detections, or people are off.
  std::optional<PeopleSummary> people;
  /// Unset when the log has no loop closures, or is followed and has brought none.
  std::optional<LoopCounts> loops;
  /// Poses and graphs with content that the log gave, whether or not the map had them.
  int64_t given_count = 0;
  /// An earlier run has committed a part of the log, or all of it.
  bool was_known = false;
  /// A followed log was stopped, and its end was not told: the same run goes on with it.
  bool is_paused = false;
};

/// What a log and its options call for in a map.
/// Errors: of MappingOptions::Validate, of the map, of DetectorFeed::Make.
absl::StatusOr<RunPlan> MakePlan(const LogInfo& info, const IngestOptions& options,
                                 const MapView& map, const std::string& session_id);

/// Reads `log` to its end. The same log, options and starting map give byte-equal deltas. A run
/// that was cut off is continued by running it again; a log that the map holds adds nothing.
/// `on_progress` (may be empty) gets the count of measurements read so far.
///
/// Of a followed log, poses are committed a second after they were read; a log with sensors goes by
/// its own time (follow_pose_period_ns; MappingOptions::commit_period_ns). If one is stopped
/// (FollowOptions::stop), what was committed stays and its end is not told.
///
/// `log_options`: what the log was opened with.
/// Errors: NOT_FOUND/NO_REGISTRATION for poses of odometry, which begin anywhere, in a map that
/// holds another log, without a transform; of the log, and of DeltaSink::Put. What is committed by
/// then stays, and counts.
absl::StatusOr<IngestSummary> IngestLog(LogSource& log, const LogOptions& log_options,
                                        const IngestOptions& options, const MapView& map,
                                        GraphWriter& writer,
                                        const std::function<void(int64_t)>& on_progress);

}  // namespace dsg::ingest
