// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/track_path.h"

#include <algorithm>

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

}  // namespace dsg::query
