// SPDX-License-Identifier: Apache-2.0
// What a stage of the pipeline is, and what stages tell one another.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/presence/region_index.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/trajectory/trajectory_change.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

struct IngestSummary;

/// What stages found out that others go by. A stage reads what those before it in the list wrote.
struct Findings {
  /// Of a stage that lost what it knew: nothing of what was told is committed, and the log ends.
  absl::Status status;
  /// When in the log this is, and whether the log has ended.
  TimeNs now_ns = 0;
  bool is_last = false;
  /// Whether the robot's path has been corrected: all that was told is elsewhere now.
  bool is_moved = false;
  /// Whether rooms and places were found anew; the rest is as it was then.
  bool has_new_layers = false;
  /// Rooms, places and their containment.
  GraphDelta regions;
  /// Whether nothing stands between a point and a place; empty = unknown.
  RegionIndex::Sight sight;
  /// Heights of the storeys' floors, ascending.
  std::vector<double> floors_m;
};

/// Stages are called in the order of their list, each with all of a log in its order. One that is
/// off, or that a log has nothing for, does nothing: nobody asks whether it is there.
///
/// Threads: one caller at a time.
class Stage {
 public:
  virtual ~Stage() = default;

  /// The robot's path has got another pose.
  virtual void NotePose(TimeNs) {}
  /// Takes what it needs of an image or a detection. False when it has no use for it.
  virtual bool Take(const Measurement&) { return false; }
  /// A depth frame, in the map; times do not descend.
  virtual absl::Status See(const DepthFrame&) { return absl::OkStatus(); }
  /// No more of the log will come.
  virtual void Close() {}
  /// Adds what changed since the last call to `delta`, and what others go by to `findings`.
  virtual void Tell(Findings* findings, GraphDelta* delta) = 0;
  /// The robot's path has been corrected: what was seen from it moves, by when it was seen.
  virtual void Correct(const TrajectoryChange&) {}
  /// What became of the log, for the user.
  virtual void Summarize(IngestSummary*) const {}
};

}  // namespace dsg::ingest
