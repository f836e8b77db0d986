// SPDX-License-Identifier: Apache-2.0
// The stages of one log, wired: what is measured goes to who needs it, and what they found is
// committed in an order that a map can take.
// Refuses to find anything itself.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/pipeline/agent_namer.h"
#include "ingest/pipeline/delta_builder.h"
#include "ingest/pipeline/detector_feed.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/log_regions.h"
#include "ingest/pipeline/people_told.h"
#include "ingest/pipeline/person_mapper.h"
#include "ingest/pipeline/robot_told.h"
#include "ingest/presence/stay_mender.h"
#include "ingest/presence/stay_tracker.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class LogRun {
 public:
  struct Parts {
    IngestOptions options;
    /// The map's agents when the log begins.
    std::vector<Node> agents;
    LogRegions regions;
    /// Null for logs without depth.
    std::unique_ptr<LogMapper> mapper;
    /// Null for logs without detections.
    std::unique_ptr<PersonMapper> people;
    /// Null unless a network finds the people.
    std::unique_ptr<DetectorFeed> detector;
    std::string session_id;
    std::string agent_prefix;
    double feet_below_m = 0.0;
    /// Unset for logs without sensors.
    std::optional<RobotTold> robot;
    bool has_loops = false;
    /// Of an earlier run of the session, that was cut off; 0 = there was none.
    Revision first_revision = 0;
  };

  /// Requires: `map` outlives the run.
  LogRun(Parts parts, const MapView& map, DeltaSink sink);

  /// Takes what it needs out of `measurement`.
  absl::Status Take(Measurement& measurement);
  /// The log has ended.
  absl::Status Finish();
  IngestSummary Summary() const;

 private:
  struct Waiting {
    NodeId agent;
    TimeNs time_ns;
    Eigen::Vector3d position_map;
  };

  // Whether commits go by the log's time, and not by the count of poses.
  bool IsTimed() const { return mapper_ != nullptr || people_ != nullptr || has_loops_; }

  absl::Status TakeGraph(GraphDelta graph);
  absl::Status TakePose(const PoseMeasurement& pose);
  absl::Status TakeTimedPose(NodeId agent, const PoseMeasurement& pose);
  absl::StatusOr<bool> IsToldBefore(NodeId agent, TimeNs time_ns);
  absl::StatusOr<bool> TakeSensor(Measurement* measurement);
  absl::StatusOr<bool> TakeImage(ImageMeasurement* image);
  bool TakeDetection(HumanDetection* detection);

  absl::Status CommitIfDue(TimeNs now_ns);
  absl::Status Commit(TimeNs now_ns, bool is_update, bool is_last);
  GraphDelta TakeLayers(TimeNs now_ns);
  absl::Status PutRobotGraph();
  GraphDelta Correct(const RobotGraph::Solution& solution);
  absl::Status PutContacts();
  std::vector<Edge> HeldEdges() const;
  absl::Status PutStays(std::vector<Stay> stays);
  void AwaitSightings();
  void ReplayWaiting();
  RegionIndex MakeIndex() const;
  StayTracker& Tracker();

  IngestOptions options_;
  const MapView& map_;
  AgentNamer namer_;
  LogRegions regions_;
  std::optional<StayTracker> tracker_;
  DeltaBuilder builder_;
  DeltaSink sink_;
  std::unique_ptr<LogMapper> mapper_;
  std::unique_ptr<PersonMapper> people_;
  std::unique_ptr<DetectorFeed> detector_;
  PeopleTold people_told_;
  std::optional<RobotTold> robot_;
  bool has_loops_;
  LoopCounts loops_;
  /// The layers as loop closures have moved them.
  std::optional<LayerGraph> corrected_;
  Revision first_revision_;
  /// By agent, the end of its track when the log began.
  std::map<NodeId, TimeNs> told_until_ns_;
  StayMender mender_;
  /// When the piece of the log began that is not committed yet.
  TimeNs begin_ns_ = kTimeMin;
  TimeNs last_ns_ = kTimeMin;
  std::vector<Waiting> waiting_;
  int64_t graph_agent_count_ = 0;
  std::map<std::string, int64_t> unused_;
};

}  // namespace dsg::ingest
