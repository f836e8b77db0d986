// SPDX-License-Identifier: Apache-2.0
// Times for logs that count frames: first frame at the epoch, one annotation step a period.
// Refuses fractions of a nanosecond: frames keep their distances as far as integers can.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// Replaces frame numbers by nanoseconds: epoch + (frame - first) / step * frame_period, where
/// first is the log's smallest frame and step the commonest difference of successive distinct
/// frames (the smallest of equally common ones). Exact in integers, rounded to the nearest ns.
///
/// Errors: FILE_MALFORMED when a time does not fit in 64 bits, or the period is so short that
/// two frames fall on one nanosecond.
absl::Status ApplyFrameClock(const LogOptions& options, TrackTable* table);

/// Checks the order of frames per person, gives them times, and makes the log.
absl::StatusOr<std::unique_ptr<LogSource>> MakeFrameLog(TrackTable table, const LogOptions& options,
                                                        LogInfo info);

}  // namespace dsg::ingest
