// SPDX-License-Identifier: Apache-2.0
// What happens to each measurement of a log, and what is committed when: the pipeline on one page.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/commit/delta_sink.h"
#include "ingest/correction/loop_closer.h"
#include "ingest/pipeline/agent_namer.h"
#include "ingest/pipeline/delta_builder.h"
#include "ingest/pipeline/detector_feed.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/layers_stage.h"
#include "ingest/pipeline/log_frames.h"
#include "ingest/pipeline/log_presence.h"
#include "ingest/pipeline/people_stage.h"
#include "ingest/pipeline/stage.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {

/// How long poses of a followed log wait before they are committed.
inline constexpr std::chrono::milliseconds kStaleAfter(1000);

/// What a log and its options call for.
struct RunPlan {
  IngestOptions options;
  LogInfo info;
  std::string session_id;
  std::string agent_prefix;
  /// The map's agents when the log begins.
  std::vector<Node> agents;
  LogRegions regions;
  NodeNumbering numbering;
  DetectorFeed detector;
  /// Which stages have something to do.
  bool has_layers = false;
  bool has_people = false;
  bool has_loops = false;
  /// Of an earlier run of the session, that was cut off; 0 = there was none.
  Revision first_revision = 0;
  /// Of a log that is followed: DeltaSink::SplitEnd. Unset for others.
  std::optional<int64_t> end_sequence;
  /// Stages of the caller's, after the others.
  std::vector<std::unique_ptr<Stage>> more_stages;
};

/// Threads: one caller at a time.
class LogRun {
 public:
  /// Requires: `map` outlives the run.
  LogRun(RunPlan plan, const MapView& map, DeltaSink sink);

  /// Gives a measurement to all whom it concerns, and commits what is due.
  absl::Status Take(Measurement& measurement);
  /// Of a followed log, as often as one likes: commits poses that wait for longer than kStaleAfter,
  /// if commits do not go by the log's time.
  absl::Status CommitStale();
  /// Whether commits go by the log's time, and not by the count of poses. Then a log is cut into
  /// the same deltas each time it is read, and one that is not finished can be taken up again only
  /// before its end was told.
  bool is_timed() const { return is_timed_; }
  /// The log has ended. `place_memory`: LogInfo::place_memory.
  absl::Status Finish(std::vector<std::string> place_memory);
  IngestSummary Summary() const;

 private:
  bool IsStrayLoop(const Measurement& measurement) const;
  absl::Status TakeGraph(GraphDelta graph);
  absl::Status TakePose(const PoseMeasurement& pose);
  absl::Status CommitPoses(TimeNs now_ns);
  bool AddToPath(NodeId agent, const PoseMeasurement& pose);
  absl::Status TakeSensor(Measurement& measurement);
  bool Spread(Measurement& measurement);
  absl::Status SeeFrames();

  absl::Status CommitIfDue(TimeNs now_ns);
  absl::Status Commit(TimeNs now_ns, bool is_last);
  absl::Status PutStays(std::vector<Stay> stays);
  absl::Status PutRobotGraph();
  absl::Status PutPlaceMemory(std::vector<std::string> parts);
  absl::Status CorrectPath(bool is_last);
  absl::Status FuseAgain();
  absl::Status CheckSame(const SkipCounts& skips, int64_t frame_count) const;
  void TellRobot(GraphDelta* delta);
  absl::Status PutContacts();
  std::vector<Edge> HeldEdges() const;

  IngestOptions options_;
  LogInfo info_;
  const MapView& map_;
  bool has_loops_;
  bool is_followed_;
  bool is_timed_;
  AgentNamer namer_;
  DetectorFeed detector_;
  RobotPath path_;
  NodeId robot_;
  LoopCloser loops_;
  LogFrames frames_;
  StageClock clock_;
  LayersStage layers_;
  PeopleStage people_;
  std::vector<std::unique_ptr<Stage>> more_stages_;
  /// All of them, in the order in which they are called.
  std::vector<Stage*> stages_;
  Findings findings_;
  LogPresence presence_;
  DeltaBuilder builder_;
  DeltaSink sink_;
  /// When the piece of the log began that is not committed yet.
  TimeNs begin_ns_ = kTimeMin;
  TimeNs last_ns_ = kTimeMin;
  /// Of a followed log: the pose that was the last to be committed as it came.
  TimeNs last_pose_ns_ = kTimeMin;
  /// Since when poses wait, by this machine's clock.
  std::optional<std::chrono::steady_clock::time_point> waits_since_;
  int64_t graph_agent_count_ = 0;
  std::map<std::string, int64_t> unused_;
};

}  // namespace dsg::ingest
