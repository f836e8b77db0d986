// SPDX-License-Identifier: Apache-2.0
// What can be asked of a sensor log, with defaults and bounds.
// Refuses values that no log could hold, naming the option as the command line spells it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/simulator/world/options.h"

namespace dsg::simulator {

/// Frames [begin, end) of a log.
struct FrameRange {
  int64_t begin = 0;
  int64_t end = 0;
  bool operator==(const FrameRange&) const = default;
};

/// "100:200". Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::StatusOr<FrameRange> ParseFrameRange(std::string_view text);

/// Everything that decides the content of a log.
struct SensorsOptions {
  WorldOptions world;
  /// 0 to 250: the instances of a class fit in eight bits.
  int people_count = 3;
  /// 1 to 3600.
  double duration_s = 25.0;
  /// Stereo pairs a second, 1 to 60.
  double rate_hz = 20.0;
  /// Every n-th pair is a keyframe with colour, depth, labels and detections, 1 to 60.
  int keyframe_every = 4;
  /// Of the inertial unit's noise against its data sheet, 0 to 100.
  double imu_noise_factor = 1.0;
  /// Of the calibration errors (0.3 px, 0.1 degrees, 2 mm, 1 ms), 0 to 100.
  double calibration_error_factor = 1.0;
  /// Detections have the vertices of bodies, as networks that regress a mesh give them.
  bool has_bodies = false;

  int64_t FrameCount() const;
  /// First stamp: some time in the years from 2023 on, drawn from all options.
  TimeNs BeginNs() const;
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the option, its value and its bounds.
  absl::Status Validate() const;
  /// The options as they are typed: names the log, and tells whether a run continues another.
  std::string CommandLine() const;
};

}  // namespace dsg::simulator
