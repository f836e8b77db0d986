// SPDX-License-Identifier: Apache-2.0
// Writes a sensor log with its ground truth: images, inertial samples, detections.
// Refuses to show anything unfinished as a log: it appears in one rename.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/simulator/body/detector.h"
#include "ingest/simulator/sensors/render_frames.h"
#include "ingest/simulator/sensors/sensors_options.h"

namespace dsg::simulator {

/// What a run does, besides what the log holds.
struct SensorsRun {
  /// Folder to write; made when missing.
  std::string out;
  /// Replace a finished log, or a begun one of other options.
  bool force = false;
  /// Write out/log.bag too; also for a log that is finished already.
  bool bag = false;
  /// Render only these and leave the rest to other runs, which may go on at the same time; the
  /// run without a range finishes the log.
  std::optional<FrameRange> frames;
  /// 0 = one a core.
  int thread_count = 0;
};

struct SensorsSummary {
  /// False after a run over a range of frames.
  bool is_finished = false;
  /// The log was finished before; this run wrote its bag and counted nothing.
  bool is_bag_only = false;
  int64_t frame_count = 0;
  int64_t keyframe_count = 0;
  int64_t imu_count = 0;
  int64_t pick_count = 0;
  /// Corridors and hallways among them.
  int64_t room_count = 0;
  int64_t rooms_visited = 0;
  /// Of the free cells, that a camera saw.
  double free_observed_share = 0.0;
  DetectionStatistics detections;
};

/// Writes out/log (for dsg-ingest), out/truth (for dsg-eval), out/README.txt and, if asked for,
/// out/log.bag. A run that was cut off is continued by running it again: complete frames are kept.
/// Same options, same bytes.
///
/// Errors: of SensorsOptions::Validate; ALREADY_EXISTS for a folder that holds something else and
/// no force; RESOURCE_EXHAUSTED/DISK_FULL, after which the run may be continued.
/// Cost: about 0.1 s a stereo pair on two cores.
absl::StatusOr<SensorsSummary> WriteSensors(const SensorsOptions& options, const SensorsRun& run,
                                            const SensorsProgress& progress);

}  // namespace dsg::simulator
