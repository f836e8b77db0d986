// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/track_path.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "schema/base/status.h"

namespace dsg::query {

uint64_t TimeApart(TimeNs from_ns, TimeNs to_ns) {
  return static_cast<uint64_t>(to_ns) - static_cast<uint64_t>(from_ns);
}

TimeNs AddTime(TimeNs time_ns, TimeNs span_ns) {
  if (span_ns > 0 && time_ns > kTimeMax - span_ns) return kTimeMax;
  if (span_ns < 0 && time_ns < kTimeMin - span_ns) return kTimeMin;
  return time_ns + span_ns;
}

bool TrackPath::IsJoined(size_t i) const {
  return TimeApart(points[i].time_ns, points[i + 1].time_ns) <= static_cast<uint64_t>(gap_ns_max);
}

Eigen::Vector3d PositionBetween(const TrackPoint& a, const TrackPoint& b, TimeNs at_ns) {
  if (at_ns >= b.time_ns) return b.position_map;
  const double fraction = static_cast<double>(TimeApart(a.time_ns, at_ns)) /
                          static_cast<double>(TimeApart(a.time_ns, b.time_ns));
  return a.position_map + fraction * (b.position_map - a.position_map);
}

absl::StatusOr<TrackPath> ReadTrackPath(const Snapshot& snapshot, const TrackInfo& track,
                                        TimeNs from_ns, TimeNs to_ns, const StopCheck& stop) {
  TrackPath path{track.agent, track.gap_ns_max, {}};
  if (track.pose_count == 0 || from_ns > track.last_ns || to_ns < track.first_ns) return path;
  DSG_ASSIGN_OR_RETURN(const LocatedPose first,
                       snapshot.Locate(track.agent, std::max(from_ns, track.first_ns)));
  DSG_ASSIGN_OR_RETURN(const LocatedPose last,
                       snapshot.Locate(track.agent, std::min(to_ns, track.last_ns)));
  DSG_RETURN_IF_ERROR(snapshot.ReadPoses(
      track.agent, first.before_ns, AddTime(last.after_ns, 1), stop, [&](const TimedPose& pose) {
        path.points.push_back({pose.time_ns, pose.map_T_agent.position});
        return true;
      }));
  return path;
}

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
