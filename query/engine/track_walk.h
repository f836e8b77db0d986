// SPDX-License-Identifier: Apache-2.0
// The poses of one track in turn, as they are stored or interpolated at a period, for replies in
// many messages.
#pragma once

#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "query/engine/request.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Which poses of a track to walk over.
struct WalkRange {
  /// Half-open; unset = from the first pose, and up to and including the last.
  std::optional<TimeNs> from_ns;
  std::optional<TimeNs> to_ns;
  /// 0 = the stored poses, else those at from_ns (or the first pose) and every period after it.
  TimeNs period_ns = 0;
};

/// Errors: FIELD_INVALID for a period below 1 ms, but 0; TIME_RANGE_INVERTED.
absl::Status CheckWalkRange(const WalkRange& range);

/// The range of a request with from_ns, to_ns and resample_period_ns. Errors: as CheckWalkRange.
template <typename Request>
absl::StatusOr<WalkRange> WalkRangeOf(const Request& request) {
  WalkRange range;
  if (request.has_from_ns()) range.from_ns = request.from_ns();
  if (request.has_to_ns()) range.to_ns = request.to_ns();
  range.period_ns = request.resample_period_ns();
  DSG_RETURN_IF_ERROR(CheckWalkRange(range));
  return range;
}

/// A walk along one track that can pause at any pose.
///
/// Threads: one caller at a time.
class TrackWalk {
 public:
  TrackWalk(TrackInfo track, const WalkRange& range);

  const TrackInfo& track() const { return track_; }
  bool done() const { return is_done_; }

  /// Poses that follow one another without a gap, and how many of them were taken.
  /// `is_after_gap`: the track has a gap between the first of them and the pose before it.
  using Take = std::function<size_t(absl::Span<const TimedPose> poses, bool is_after_gap)>;

  /// Gives the poses to `take`, until it takes fewer than it is given: the first of the others
  /// comes first in the next call. Errors: of the store; what `stop` returned.
  absl::Status Read(const Snapshot& snapshot, const StopCheck& stop, const Take& take);

 private:
  absl::Status ReadStored(const Snapshot& snapshot, const StopCheck& stop, const Take& take);
  absl::Status Resample(const Snapshot& snapshot, const StopCheck& stop, const Take& take);
  // Of poses as they are stored; false if `take` left some.
  bool TakeRun(absl::Span<const TimedPose> poses, const Take& take);
  // Whether the track has a gap between the pose before and the next one, neither of which lies in
  // one.
  absl::StatusOr<bool> StepsOverGap(const Snapshot& snapshot, const StopCheck& stop) const;
  bool IsPastEnd(TimeNs time_ns) const;

  TrackInfo track_;
  TimeNs period_ns_;
  TimeNs grid_from_ns_;
  // The first instant that was not walked over yet.
  TimeNs next_ns_;
  TimeNs to_ns_;
  // Of the pose before, if there was one.
  std::optional<TimeNs> last_ns_;
  bool is_after_gap_ = false;
  bool is_done_;
};

}  // namespace dsg::query
