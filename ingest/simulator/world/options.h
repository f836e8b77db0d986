// SPDX-License-Identifier: Apache-2.0
// What can be asked of the simulator, with defaults and bounds.
// Refuses values that no log could hold, naming the option as the command line spells it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// Whether an option's value is from `low` to `high`; NaN is not.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID with option, value and bounds.
absl::Status CheckRange(const char* option, double value, double low, double high,
                        const char* unit);

enum class WorldKind {
  /// 65 m x 65 m: a grid of corridors, 30 to 50 rooms, open halls.
  kOffice,
  /// About 40 m x 14 m: a corridor with 16 rooms on both sides.
  kWing,
  /// About 14 m x 12 m: a hallway with five rooms.
  kApartment,
};

/// "office", "wing" or "apartment". Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::StatusOr<WorldKind> ParseWorldKind(std::string_view text);
/// As ParseWorldKind reads it.
std::string_view Name(WorldKind kind);

struct WorldOptions {
  WorldKind kind = WorldKind::kWing;
  uint64_t seed = 1;
};

/// Who walks, and for how long.
struct CrowdOptions {
  /// 0 to 10,000; a robot is always there too.
  int people_count = 5;
  /// 1 to 86,400.
  double duration_s = 300.0;

  absl::Status Validate() const;
};

/// What a tracker makes of the walks.
struct TrackSensorOptions {
  /// 0.1 to 200.
  double rate_hz = 10.0;
  /// Standard deviation on each axis, 0 to 10.
  double position_noise_m = 0.02;
  /// Standard deviation, 0 to 3.
  double yaw_noise_rad = 0.01;
  /// Standard deviation of the instants of sampling, 0 to 1; cut at 0.4 periods.
  double clock_jitter_s = 0.0005;
  /// Track losses of a person per tracked minute, 0 to 60. The robot is never lost.
  double gap_rate_per_min = 0.2;
  double gap_s_min = 3.0;
  double gap_s_max = 20.0;

  absl::Status Validate() const;
};

/// Everything that `dsg-simulate tracks` takes.
struct TracksOptions {
  /// Folder to write; made when missing.
  std::string out;
  /// Write into a folder that holds something, replacing files of the same names.
  bool force = false;
  WorldOptions world;
  CrowdOptions crowd;
  TrackSensorOptions sensor;
  /// Things that people take away, if they come near so many; 0 to 1000.
  int pick_count = 0;

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the option and its bounds.
  absl::Status Validate() const;
};

}  // namespace dsg::simulator
