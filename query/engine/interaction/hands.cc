// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/hands.h"

#include <algorithm>
#include <cmath>

#include "schema/base/status.h"
#include "schema/model/geometry.h"

namespace dsg::query {
namespace {

// Of SMPL's 24 joints.
constexpr size_t kJointCount = 24;
constexpr size_t kHands[] = {22, 23};
// Straight stretches are looked at in steps of this; a person walks 15 cm meanwhile.
constexpr TimeNs kStepNs = kNsPerSecond / 10;

double FloorDistance(const Eigen::Vector3d& point_map, const Box3d& box_map) {
  const double dx =
      std::max({box_map.min().x() - point_map.x(), 0.0, point_map.x() - box_map.max().x()});
  const double dy =
      std::max({box_map.min().y() - point_map.y(), 0.0, point_map.y() - box_map.max().y()});
  return std::hypot(dx, dy);
}

double Seconds(uint64_t span_ns) {
  return static_cast<double>(span_ns) / static_cast<double>(kNsPerSecond);
}

// Walks along a path once, in time.
class VisitFinder {
 public:
  VisitFinder(const Box3d& box_map, const Interval& during, Nearness* out)
      : box_map_(box_map), during_(during), out_(*out) {}

  void Walk(const TrackPath& path) {
    if (path.points.empty()) return;
    Appear(path.points.front());
    for (size_t i = 0; i < path.points.size(); ++i) {
      const TrackPoint& point = path.points[i];
      if (point.time_ns >= during_.from_ns && point.time_ns <= during_.to_ns) {
        See(point.time_ns, point.position_map);
      }
      if (i + 1 == path.points.size()) break;
      const TrackPoint& next = path.points[i + 1];
      if (path.IsJoined(i)) {
        Follow(point, next);
      } else if (TimeApart(point.time_ns, next.time_ns) <= uint64_t{2} * kAboutNs) {
        MayVisit(ComeBy(point), LeaveBy(next));
      } else {
        Vanish(point);
        Appear(next);
      }
    }
    Vanish(path.points.back());
  }

 private:
  TimeNs WayNs(const TrackPoint& point) const {
    const double way_m = std::max(0.0, FloorDistance(point.position_map, box_map_) - kReachM);
    return static_cast<TimeNs>(std::min(way_m / kWalkMS, 1e6) * static_cast<double>(kNsPerSecond));
  }
  TimeNs ComeBy(const TrackPoint& point) const { return AddTime(point.time_ns, WayNs(point)); }
  TimeNs LeaveBy(const TrackPoint& point) const { return AddTime(point.time_ns, -WayNs(point)); }

  // Who was away for long may have been anywhere meanwhile, and here in no particular.
  void Vanish(const TrackPoint& point) {
    MayVisit(ComeBy(point), AddTime(point.time_ns, kAboutNs));
    is_open_ = false;
  }
  void Appear(const TrackPoint& point) {
    MayVisit(AddTime(point.time_ns, -kAboutNs), LeaveBy(point));
  }

  Visit& Open(TimeNs at_ns) {
    if (!is_open_) {
      Visit visit;
      visit.during = {at_ns, at_ns};
      out_.visits.push_back(visit);
    }
    is_open_ = true;
    return out_.visits.back();
  }

  // Nobody looked; it may have been within reach all the while.
  void MayVisit(TimeNs from_ns, TimeNs to_ns) {
    from_ns = std::max(from_ns, during_.from_ns);
    to_ns = std::min(to_ns, during_.to_ns);
    was_near_ = false;
    if (from_ns >= to_ns) {
      is_open_ = false;
      return;
    }
    Visit& visit = Open(from_ns);
    visit.unseen_s += Seconds(TimeApart(from_ns, to_ns));
    visit.during.to_ns = to_ns;
  }

  void See(TimeNs at_ns, const Eigen::Vector3d& torso_map) {
    const double distance_m = FloorDistance(torso_map, box_map_);
    if (!out_.torso_m.has_value() || distance_m < *out_.torso_m) {
      out_.torso_m = distance_m;
      out_.torso_ns = at_ns;
    }
    was_near_ = distance_m <= kDwellM;
    if (distance_m > kReachM) {
      is_open_ = false;
      return;
    }
    Visit& visit = Open(at_ns);
    if (!visit.is_seen || distance_m < visit.torso_m) {
      visit.torso_m = distance_m;
      visit.torso_ns = at_ns;
    }
    if (!visit.is_seen) visit.seen.from_ns = at_ns;
    visit.is_seen = true;
    visit.seen.to_ns = at_ns;
    visit.during.to_ns = at_ns;
  }

  void Follow(const TrackPoint& a, const TrackPoint& b) {
    TimeNs from_ns = std::max(a.time_ns, during_.from_ns);
    const TimeNs to_ns = std::min(b.time_ns, during_.to_ns);
    if (from_ns >= to_ns) return;
    See(from_ns, PositionBetween(a, b, from_ns));
    while (from_ns < to_ns) {
      const TimeNs next_ns = std::min(to_ns, from_ns + kStepNs);
      const bool was_near = was_near_;
      See(next_ns, PositionBetween(a, b, next_ns));
      if (was_near && was_near_) {
        out_.visits.back().dwell_s += Seconds(TimeApart(from_ns, next_ns));
      }
      from_ns = next_ns;
    }
  }

  const Box3d& box_map_;
  const Interval during_;
  Nearness& out_;
  bool is_open_ = false;
  bool was_near_ = false;
};

absl::Status MeasureHands(const Snapshot& snapshot, NodeId agent, const Box3d& box_map,
                          const StopCheck& stop, Visit* out) {
  const auto visit = [&](const ShownShape& shown) {
    const std::vector<float>& joints = shown.shape.joints;
    if (joints.size() < 3 * kJointCount) return true;
    const absl::StatusOr<LocatedPose> pose = snapshot.Locate(agent, shown.shape.time_ns);
    // A shape without its pose is nowhere.
    if (!pose.ok() || pose->quality == PoseQuality::kInGap) return true;
    for (const size_t hand : kHands) {
      const Eigen::Vector3d hand_agent(joints[3 * hand], joints[3 * hand + 1],
                                       joints[3 * hand + 2]);
      if (!hand_agent.allFinite()) continue;
      const double distance_m = DistanceToBox(pose->map_T_agent * hand_agent, box_map);
      if (out->hand_m.has_value() && distance_m >= *out->hand_m) continue;
      out->hand_m = distance_m;
      out->hand_ns = shown.shape.time_ns;
    }
    return true;
  };
  return snapshot.ReadShapes(agent, out->during.from_ns, AddTime(out->during.to_ns, 1),
                             /*with_vertices=*/false, stop, visit);
}

}  // namespace

absl::StatusOr<Nearness> MeasureNearness(const Snapshot& snapshot, const TrackInfo& track,
                                         const Box3d& box_map, const Interval& during,
                                         const StopCheck& stop) {
  Nearness result;
  // What nobody saw lies between what was seen before and after.
  DSG_ASSIGN_OR_RETURN(const TrackPath path,
                       ReadTrackPath(snapshot, track, AddTime(during.from_ns, -kAboutNs),
                                     AddTime(during.to_ns, kAboutNs), stop));
  VisitFinder(box_map, during, &result).Walk(path);
  for (Visit& visit : result.visits) {
    if (!visit.is_seen) continue;
    DSG_RETURN_IF_ERROR(MeasureHands(snapshot, track.agent, box_map, stop, &visit));
  }
  return result;
}

}  // namespace dsg::query
