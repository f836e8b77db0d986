// SPDX-License-Identifier: Apache-2.0
// Renders a range of frames with all cores; may be stopped and continued at any time.
// Refuses to finish a log; sensors_log.h does.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "ingest/simulator/sensors/session.h"

namespace dsg::simulator {

/// Gets what is done and the share of it, 0 to 1; called from one thread at a time.
using SensorsProgress = std::function<void(const char* step, double share)>;

/// Calls `work(index)` for each index of [0, count) on `thread_count` threads and reports progress.
/// Returns the first error; what was begun is ended, nothing new begins after it.
absl::Status ForEachInParallel(int64_t count, int thread_count, const char* step,
                               const SensorsProgress& progress,
                               const std::function<absl::Status(int64_t)>& work);

/// Frames of `range` that are complete already are left as they are.
/// Errors: RESOURCE_EXHAUSTED/DISK_FULL and others of OutputFile; complete frames stay.
absl::Status RenderFrames(const SensorSession& session, const FrameRange& range,
                          const std::string& log_folder, int thread_count,
                          const SensorsProgress& progress);

}  // namespace dsg::simulator
