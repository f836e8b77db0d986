// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/observed_time.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "query/engine/interaction/track_path.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

double Length(const Interval& interval) {
  return static_cast<double>(TimeApart(interval.from_ns, interval.to_ns));
}

// What is left of `open` once the stretches of a track are taken out of it.
absl::StatusOr<std::vector<Interval>> WithoutTrack(const Snapshot& snapshot, const TrackInfo& track,
                                                   const std::vector<Interval>& open,
                                                   const StopCheck& stop) {
  std::vector<Interval> left;
  for (const Interval& gap : open) {
    DSG_ASSIGN_OR_RETURN(const TrackPath path,
                         ReadTrackPath(snapshot, track, gap.from_ns, gap.to_ns, stop));
    TimeNs from_ns = gap.from_ns;
    for (size_t i = 0; i + 1 < path.points.size(); ++i) {
      if (!path.IsJoined(i)) continue;
      const TimeNs begin_ns = std::clamp(path.points[i].time_ns, gap.from_ns, gap.to_ns);
      const TimeNs end_ns = std::clamp(path.points[i + 1].time_ns, gap.from_ns, gap.to_ns);
      if (begin_ns > from_ns) left.push_back({from_ns, begin_ns});
      from_ns = std::max(from_ns, end_ns);
    }
    if (from_ns < gap.to_ns) left.push_back({from_ns, gap.to_ns});
  }
  return left;
}

}  // namespace

absl::StatusOr<double> ObservedShare(const Snapshot& snapshot, const Interval& during,
                                     const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(std::vector<TrackInfo> tracks, snapshot.Tracks());
  std::stable_sort(tracks.begin(), tracks.end(), [](const TrackInfo& a, const TrackInfo& b) {
    return std::pair(a.kind != kinds::kRobot, -a.pose_count) <
           std::pair(b.kind != kinds::kRobot, -b.pose_count);
  });
  std::vector<Interval> open = {during};
  for (const TrackInfo& track : tracks) {
    if (open.empty()) break;
    DSG_ASSIGN_OR_RETURN(open, WithoutTrack(snapshot, track, open, stop));
  }
  double unobserved = 0.0;
  for (const Interval& gap : open) unobserved += Length(gap);
  return 1.0 - unobserved / Length(during);
}

}  // namespace dsg::query
