// SPDX-License-Identifier: Apache-2.0
// In which rooms and at which places the agents of a log were: by the map's regions, and by those
// that the log itself shows while it runs.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/commit/map_view.h"
#include "ingest/pipeline/layer_graph.h"
#include "ingest/pipeline/stage.h"
#include "ingest/presence/region_index.h"
#include "ingest/presence/stay_mender.h"
#include "ingest/presence/stay_tracker.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Rooms and places that stays are derived from: the map's, and the log's own.
///
/// Threads: one caller at a time.
class LogRegions {
 public:
  /// The map's, without those that `own` has numbered: an interrupted run of the same session has
  /// left them, and an undisturbed one would not know them yet.
  /// Errors: of the map.
  static absl::StatusOr<LogRegions> Read(const MapView& map,
                                         const std::optional<NodeNumbering>& own);

  /// The log's word on a node replaces the map's, as it will once it is committed; so a resumed
  /// run, which finds both the same, sees the same rooms.
  void Add(const GraphDelta& graph);

  /// The rooms and places that this log has found so far, instead of those it had found before.
  void SetFound(GraphDelta found) { found_ = std::move(found); }

  RegionIndex MakeIndex(const RegionOptions& options) const;

 private:
  std::vector<Node> rooms_;
  std::vector<Node> places_;
  std::vector<RegionIndex::Containment> contains_;
  GraphDelta found_;
};

/// Of a log that shows no rooms (`finds_rooms` false), stays begin with its first pose. Of one that
/// does, positions wait until rooms and places were told for the first time.
///
/// Threads: one caller at a time.
class LogPresence {
 public:
  /// `first_revision`: of an earlier run of the session that was cut off; 0 = there was none.
  /// Requires: `map` outlives this.
  LogPresence(LogRegions regions, const MapView& map, Revision first_revision, bool finds_rooms,
              const RegionOptions& options);

  /// Rooms and places of a ready-made graph.
  void AddGraph(const GraphDelta& graph) { regions_.Add(graph); }

  /// At once: for logs that are not committed by time. Times ascend per agent.
  void Observe(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map);
  /// Of a pose, unless another log has told the map of this agent and instant. Errors: of the map.
  absl::Status Await(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map);
  /// Of somebody whom this log alone has seen.
  void AwaitSighting(NodeId agent, TimeNs time_ns, const Eigen::Vector3d& position_map);

  /// Takes rooms and places that were found anew.
  void TakeRegions(const Findings& findings);
  /// The robot's path has moved, and all that was seen from it.
  void Correct(const TrajectoryChange& change);
  /// What was found is told: positions that wait may be in it.
  void GoOn();
  /// The log has ended.
  void Finish();

  /// Stays that ended or began since the last call.
  std::vector<Stay> TakeChanges();
  /// The same, which are remembered, to be mended when rooms are told apart.
  std::vector<Stay> TakeRemembered();
  /// Ended stays whose room or place is another by now (StayMender).
  std::vector<Stay> Mend();

 private:
  struct Waiting {
    NodeId agent;
    TimeNs time_ns;
    Eigen::Vector3d position_map;
  };

  absl::StatusOr<bool> IsToldBefore(NodeId agent, TimeNs time_ns);
  void ReplayWaiting();
  RegionIndex MakeIndex() const;
  StayTracker& Tracker();

  LogRegions regions_;
  const MapView& map_;
  Revision first_revision_;
  bool finds_rooms_;
  RegionOptions options_;
  RegionIndex::Sight sight_;
  std::optional<StayTracker> tracker_;
  StayMender mender_;
  /// By agent, the end of its track when the log began.
  std::map<NodeId, TimeNs> told_until_ns_;
  std::vector<Waiting> waiting_;
};

}  // namespace dsg::ingest
