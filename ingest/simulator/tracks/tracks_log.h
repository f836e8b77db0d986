// SPDX-License-Identifier: Apache-2.0
// Writes a people-track log of a world with its ground truth: the format "dsg-tracks".
// Refuses to keep the log in memory; it streams, whatever its length.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/simulator/world/options.h"

namespace dsg::simulator {

/// First line of tracks.csv, in the log and in the truth.
inline constexpr char kTracksHeader[] = "time_ns,agent,kind,x,y,z,qx,qy,qz,qw";

struct TracksSummary {
  int64_t room_count = 0;
  int64_t object_count = 0;
  int64_t place_count = 0;
  int64_t people_count = 0;
  /// Rows in the log; what falls into gaps is in the truth only.
  int64_t pose_count = 0;
  int64_t truth_pose_count = 0;
  int64_t gap_count = 0;
  /// Rooms entered, over all agents.
  int64_t visit_count = 0;
  /// Things that people take away; fewer than asked for if they stand beside too few small ones.
  int64_t pick_count = 0;
  int64_t byte_count = 0;
};

/// Called with the share that is done, 0 to 1, about once a simulated instant.
using Progress = std::function<void(double)>;

/// Writes under options.out: log/map.json and log/tracks.csv (what to ingest), truth/tracks.csv,
/// truth/presence.csv, truth/pauses.csv and truth/picks.csv, README.txt, preview.png. Same options,
/// same bytes.
///
/// Errors: INVALID_ARGUMENT for bad options; ALREADY_EXISTS when the folder holds something and
/// force is off; RESOURCE_EXHAUSTED/DISK_FULL. No file is left half written.
/// Cost: about a second a million poses; memory does not grow with the log's length.
absl::StatusOr<TracksSummary> WriteTracks(const TracksOptions& options, const Progress& progress);

}  // namespace dsg::simulator
