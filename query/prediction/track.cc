// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/track.h"

#include <algorithm>

namespace dsg::query {
namespace {

/// Requires: before <= time <= after.
PathPoint Between(const PathPoint& before, const PathPoint& after, TimeNs time_ns) {
  const double share = static_cast<double>(time_ns - before.time_ns) /
                       static_cast<double>(after.time_ns - before.time_ns);
  return {time_ns, before.position_map + share * (after.position_map - before.position_map)};
}

}  // namespace

std::vector<PathPoint> RecentTrack(const std::vector<PathPoint>& poses, TimeNs gap_ns_max) {
  if (poses.empty()) return {};
  std::vector<PathPoint> points = {poses.back()};
  const TimeNs last_ns = poses.back().time_ns;
  TimeNs age_ns = kTrackStepNs;
  size_t i = poses.size() - 1;
  while (i > 0 && age_ns <= kTrackSeenNs) {
    const PathPoint& after = poses[i];
    const PathPoint& before = poses[i - 1];
    if (after.time_ns - before.time_ns > gap_ns_max) break;
    if (last_ns - before.time_ns < age_ns) {
      --i;
      continue;
    }
    points.push_back(Between(before, after, last_ns - age_ns));
    age_ns += kTrackStepNs;
  }
  // `i` is now the first pose that no gap parts from the last one, unless there were enough.
  if (points.size() == 1 && last_ns - poses[i].time_ns >= kTrackStepNs / 2) {
    points.push_back(poses[i]);
  }
  std::reverse(points.begin(), points.end());
  return points;
}

}  // namespace dsg::query
