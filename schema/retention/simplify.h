// SPDX-License-Identifier: Apache-2.0
// Thins a track: drops poses that interpolation in time restores. Gaps stay gaps, and kept poses do
// not change.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/trajectory.h"

namespace dsg {

struct SimplifyOptions {
  /// Bounds of what Interpolate() gives at the time of a dropped pose, against that pose.
  double position_m = 0.05;
  double rotation_rad = 0.1;
  /// Of the agent's track.
  TimeNs gap_ns_max = 2 * kNsPerSecond;
  /// Only poses inside are dropped; the poses beside a dropped one are inside too.
  Interval span;
};

/// Takes the poses of a track one after the other and tells which to drop.
///
/// The bound: at the time of each dropped pose, linear interpolation between the kept poses on both
/// sides is within `position_m` of its position, and slerp within `rotation_rad` of its orientation
/// (which poses with kNoOrientation do not have). Both sides are at most `gap_ns_max` apart, so
/// what was interpolated before is interpolated still, and what was a gap still is one. In between
/// the stored poses nothing is promised beyond that of the poses themselves.
///
/// How: top-down Douglas-Peucker with the time-synchronised distance (Meratnia and de By, 2004,
/// TD-TR) in windows of fixed instants, the first pose of each being kept. Windows make it a
/// stream, and thinning what is thin drops nothing: the bound does not grow from day to day. Kept
/// are also the poses on both sides of a gap, of a change of flags, and of a change from poses with
/// a covariance to such without. (Where forgetting cuts a window in two after it was thinned, what
/// is left of it may be thinned once more, and the bound doubles there.)
///
/// Order:   Add by growing time, then Finish.
/// Threads: one caller at a time.
/// Source:  Meratnia and de By, "Spatiotemporal compression techniques for moving point objects",
///          EDBT 2004.
class TrackThinner {
 public:
  using Drop = std::function<void(const TimedPose&)>;

  TrackThinner(const SimplifyOptions& options, Drop drop);

  void Add(const TimedPose& pose);
  /// What follows has no connection to what was: poses between are forgotten.
  void Break() { Close(); }
  /// No pose follows. `is_whole`: the last one ends the track; else it ends what was asked for, and
  /// the window that it is in is left as it is.
  void Finish(bool is_whole);

 private:
  int64_t WindowOf(TimeNs time_ns) const;
  void Close();

  const SimplifyOptions options_;
  const TimeNs window_ns_;
  const Drop drop_;
  std::vector<TimedPose> window_;
};

/// Which of the poses to keep, as TrackThinner has it for one window without gaps. The first and
/// the last are kept. Order: as `poses`.
std::vector<bool> KeepInWindow(const std::vector<TimedPose>& poses, const SimplifyOptions& options);

}  // namespace dsg
