// SPDX-License-Identifier: Apache-2.0
// How fast someone walks on: those who slow down come to rest, those who set out reach the pace of
// a walk. Refuses to know the way: speeds only.
#pragma once

#include <vector>

#include "query/prediction/prediction.h"

namespace dsg::query {

/// A speed that changes evenly until it is `end_m_s`, and stays so.
struct Pace {
  double speed_m_s = 0.0;
  double end_m_s = 0.0;
  /// Not negative; 0 = the speed stays as it is.
  double change_m_s2 = 0.0;

  double SpeedAt(double seconds) const;
  /// Walked after `seconds`.
  double WayM(double seconds) const;
  double peak_m_s() const { return speed_m_s > end_m_s ? speed_m_s : end_m_s; }
};

/// Even, at `speed_m_s`, unless the last three steps tell of a change. Steps that turn tell
/// nothing: around a corner they look short.
Pace PaceOf(const std::vector<PathPoint>& path, double speed_m_s, const GoalOptions& options);

}  // namespace dsg::query
