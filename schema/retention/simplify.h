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
  /// Bounds of the difference between a dropped pose and Interpolate() at its time.
  double position_m = 0.05;
  double rotation_rad = 0.1;
  /// Gap length of the track.
  TimeNs gap_ns_max = 2 * kNsPerSecond;
  /// Only poses inside are dropped; the neighbours of a dropped pose are inside too.
  Interval span;
};

/// Takes the poses of a track one by one and reports those to drop.
/// Bound: at the time of each dropped pose, linear interpolation between its kept neighbours is
/// within `position_m` of its position, and slerp within `rotation_rad` of its orientation (if it
/// has one). The kept neighbours are at most `gap_ns_max` apart, so gaps stay gaps and no new ones
/// appear. The bound holds at the times of the dropped poses only.
/// Method: top-down Douglas-Peucker with the time-synchronised distance (TD-TR), in windows at
/// fixed instants, whose first poses are kept. Windows allow streaming, and thinning a thinned
/// track drops nothing, so the bound does not grow with repetition. Poses beside a gap, beside a
/// change of flags, and where covariances begin or end are kept too. (If forgetting cuts a thinned
/// window in two, its rest may be thinned once more, and the bound doubles there.)
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
  /// Poses between the last one and the next are forgotten, so the two are not connected.
  void Break() { Close(); }
  /// No pose follows. `is_whole`: the last pose ends the track. Otherwise the track goes on, and
  /// the last window is not thinned.
  void Finish(bool is_whole);

 private:
  int64_t WindowOf(TimeNs time_ns) const;
  void Close();

  const SimplifyOptions options_;
  const TimeNs window_ns_;
  const Drop drop_;
  std::vector<TimedPose> window_;
};

/// Which poses TrackThinner keeps in one window without gaps, by index. Always the first and the
/// last.
std::vector<bool> KeepInWindow(const std::vector<TimedPose>& poses, const SimplifyOptions& options);

}  // namespace dsg
