// SPDX-License-Identifier: Apache-2.0
// A robot's trajectory in a map, as it was first told and as it is believed, and its loop closures.
// Refuses to open the ground truth, so that nothing of it can leak into an estimate.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/evaluation/loops.h"
#include "ingest/evaluation/trajectory.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {

/// Told now and then what is being done and how far it is, 0 to 1. May be empty.
using ProgressFunction = std::function<void(const std::string& what, double fraction)>;

/// Without predicted poses. Ascending by time.
struct RobotTracks {
  NodeId agent;
  std::string name;
  /// A pose counts as first told when a revision ends the track later than the one before did.
  /// Poses put in by a later correction were never said in time and are left out.
  std::vector<StampedPose> causal;
  /// As believed at the revision: smoothed, and corrected by loop closures.
  std::vector<StampedPose> corrected;
  /// "loop_closure" and "loop_closure_rejected" factors of the robot to itself.
  std::vector<FoundLoop> loops;
  /// What a reader of the figures should know.
  std::vector<std::string> notes;
};

/// Of the robot of that id or name; of the first one with poses if `robot` is empty, with a note if
/// there are more. nullopt when `robot` is empty and no robot has poses.
///
/// Errors: NOT_FOUND/AGENT_UNKNOWN naming the robots that are there; what the store returns.
/// Cost:   every pose once, and one look-up of the track per revision that appended poses.
absl::StatusOr<std::optional<RobotTracks>> ReadRobotTracks(MapReader& map, const Snapshot& snapshot,
                                                           const std::string& robot,
                                                           const ProgressFunction& progress);

/// The poses of an agent with from_ns <= time < to_ns that are not predicted.
absl::StatusOr<std::vector<StampedPose>> ReadStampedPoses(const Snapshot& snapshot, NodeId agent,
                                                          TimeNs from_ns, TimeNs to_ns);

}  // namespace dsg::evaluation
