// SPDX-License-Identifier: Apache-2.0
// A trajectory of a file, or those of a robot in a map, against a ground truth.
// Refuses to compare poses with times with poses without, except row by row.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/evaluation/robot_tracks.h"
#include "ingest/evaluation/track_report.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {

struct TrackRequest {
  /// As ReadPoseFile takes it.
  std::string truth;
  /// The estimate, as ReadPoseFile takes it; empty for that of a map.
  std::string estimate;
  /// Of a map: its revision (0 = the newest), and the robot (ReadRobotTracks).
  Revision revision = 0;
  std::string robot;
  /// As ReadLoopFile takes it; empty for the loop closures of the map, or none.
  std::string loops;
  /// nullopt: by rows where a file has no times, else by time with interpolation.
  std::optional<Pairing> pairing;
  /// Its pairing is that of above.
  TrackOptions options;
};

/// `map`: null with TrackRequest::estimate.
/// Errors: FIELD_INVALID when files cannot be compared as asked for; of ReadPoseFile, ReadLoopFile
/// and ReadRobotTracks.
absl::StatusOr<TrackReport> CompareTracks(const TrackRequest& request, MapReader* map,
                                          const ProgressFunction& progress);

}  // namespace dsg::evaluation
