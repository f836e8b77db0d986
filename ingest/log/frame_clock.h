// SPDX-License-Identifier: Apache-2.0
// Times for logs that count frames: first frame at the epoch, one annotation step a period.
// Refuses fractions of a nanosecond: frames keep their distances as far as integers can.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// epoch + (frame - first) / step * frame_period, exact in integers, rounded to the nearest ns.
/// Requires: `frame` is not before `first`, both within +-2^53, and `step` is positive.
/// Errors: FILE_MALFORMED when the time does not fit in 64 bits.
absl::StatusOr<TimeNs> FrameTime(const LinePosition& at, const LogOptions& options, int64_t frame,
                                 int64_t first, int64_t step);

/// Replaces frame numbers by the nanoseconds of FrameTime, where first is the log's smallest frame
/// and step the commonest difference of successive distinct frames (the smallest of equally common
/// ones).
///
/// Errors: FILE_MALFORMED when a time does not fit in 64 bits, or the period is so short that
/// two frames fall on one nanosecond.
absl::Status ApplyFrameClock(const LogOptions& options, TrackTable* table);

/// Checks the order of frames per person, gives them times, and makes the log.
absl::StatusOr<std::unique_ptr<LogSource>> MakeFrameLog(TrackTable table, const LogOptions& options,
                                                        LogInfo info);

}  // namespace dsg::ingest
