// SPDX-License-Identifier: Apache-2.0
#include "query/engine/track_walk.h"

#include <algorithm>
#include <utility>

namespace dsg::query {
namespace {

constexpr TimeNs kPeriodNsMin = 1'000'000;

// The first instant from_ns + k * period at or after `at_ns`; kTimeMax if there is none.
// Differences of far-apart times do not fit in 63 bits, so this counts in 64 without a sign.
TimeNs NextOnGrid(TimeNs from_ns, TimeNs period_ns, TimeNs at_ns) {
  if (at_ns <= from_ns) return from_ns;
  const uint64_t period = static_cast<uint64_t>(period_ns);
  const uint64_t past = (static_cast<uint64_t>(at_ns) - static_cast<uint64_t>(from_ns)) % period;
  if (past == 0) return at_ns;
  const uint64_t wait = period - past;
  const uint64_t room = static_cast<uint64_t>(kTimeMax) - static_cast<uint64_t>(at_ns);
  return wait > room ? kTimeMax : at_ns + static_cast<TimeNs>(wait);
}

}  // namespace

absl::Status CheckWalkRange(const WalkRange& range) {
  if (range.period_ns != 0 && range.period_ns < kPeriodNsMin) {
    return FieldError("resample_period_ns", absl::StrCat(range.period_ns),
                      "give at least 1000000 (1 ms), or 0 for the stored poses");
  }
  if (!range.from_ns.has_value() || !range.to_ns.has_value()) return absl::OkStatus();
  return CheckTimeRange(*range.from_ns, *range.to_ns);
}

TrackWalk::TrackWalk(TrackInfo track, const WalkRange& range)
    : track_(std::move(track)),
      period_ns_(range.period_ns),
      grid_from_ns_(range.from_ns.value_or(track_.first_ns)),
      next_ns_(grid_from_ns_),
      to_ns_(range.to_ns.value_or(kTimeMax)),
      is_done_(track_.pose_count == 0) {
  if (period_ns_ > 0 && !is_done_) {
    next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, std::max(next_ns_, track_.first_ns));
  }
}

absl::Status TrackWalk::Read(const Snapshot& snapshot, const StopCheck& stop, const Take& take) {
  if (is_done_) return absl::OkStatus();
  return period_ns_ > 0 ? Resample(snapshot, stop, take) : ReadStored(snapshot, stop, take);
}

absl::Status TrackWalk::ReadStored(const Snapshot& snapshot, const StopCheck& stop,
                                   const Take& take) {
  bool has_paused = false;
  DSG_RETURN_IF_ERROR(snapshot.ReadPoseRuns(track_.agent, next_ns_, to_ns_, stop,
                                            [&](absl::Span<const TimedPose> poses) {
                                              has_paused = !TakeRun(poses, take);
                                              return !has_paused;
                                            }));
  is_done_ = !has_paused;
  return absl::OkStatus();
}

bool TrackWalk::TakeRun(absl::Span<const TimedPose> poses, const Take& take) {
  const auto has_gap_after = [this](const TimedPose& pose, const TimedPose& next) {
    return next.time_ns - pose.time_ns > track_.gap_ns_max;
  };
  while (!poses.empty()) {
    const auto last = std::adjacent_find(poses.begin(), poses.end(), has_gap_after);
    const size_t count =
        last == poses.end() ? poses.size() : static_cast<size_t>(last - poses.begin()) + 1;
    const bool is_after_gap =
        last_ns_.has_value() && poses.front().time_ns - *last_ns_ > track_.gap_ns_max;
    const size_t taken_count = take(poses.first(count), is_after_gap);
    if (taken_count > 0) last_ns_ = poses[taken_count - 1].time_ns;
    if (taken_count < count) {
      next_ns_ = poses[taken_count].time_ns;
      return false;
    }
    poses.remove_prefix(count);
  }
  return true;
}

absl::StatusOr<bool> TrackWalk::StepsOverGap(const Snapshot& snapshot,
                                             const StopCheck& stop) const {
  // A sample of shorter periods lies in the gap.
  if (!last_ns_.has_value() || period_ns_ <= track_.gap_ns_max) return false;
  std::optional<TimeNs> before_ns;
  bool has_gap = false;
  DSG_RETURN_IF_ERROR(
      snapshot.ReadPoses(track_.agent, *last_ns_, next_ns_ + 1, stop, [&](const TimedPose& pose) {
        has_gap = before_ns.has_value() && pose.time_ns - *before_ns > track_.gap_ns_max;
        before_ns = pose.time_ns;
        return !has_gap;
      }));
  return has_gap;
}

bool TrackWalk::IsPastEnd(TimeNs time_ns) const {
  return time_ns >= to_ns_ || time_ns > track_.last_ns || time_ns == kTimeMax;
}

absl::Status TrackWalk::Resample(const Snapshot& snapshot, const StopCheck& stop,
                                 const Take& take) {
  while (!IsPastEnd(next_ns_)) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(track_.agent, next_ns_));
    if (located.quality == PoseQuality::kInGap) {
      // Straight to the far side: a night without poses must not cost a step a millisecond.
      next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, located.after_ns);
      is_after_gap_ = last_ns_.has_value();
      continue;
    }
    if (!is_after_gap_) {
      DSG_ASSIGN_OR_RETURN(is_after_gap_, StepsOverGap(snapshot, stop));
    }
    const TimedPose pose{next_ns_, located.flags, located.map_T_agent, located.covariance};
    if (take(absl::MakeConstSpan(&pose, 1), is_after_gap_) == 0) return absl::OkStatus();
    last_ns_ = next_ns_;
    is_after_gap_ = false;
    next_ns_ = NextOnGrid(grid_from_ns_, period_ns_, next_ns_ + 1);
  }
  is_done_ = true;
  return absl::OkStatus();
}

}  // namespace dsg::query
