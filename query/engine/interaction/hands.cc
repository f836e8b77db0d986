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

class TorsoMeter {
 public:
  TorsoMeter(const Box3d& box_map, Nearness* out) : box_map_(box_map), out_(*out) {}

  void See(TimeNs at_ns, const Eigen::Vector3d& torso_map) {
    const double distance_m = FloorDistance(torso_map, box_map_);
    if (!out_.torso_m.has_value() || distance_m < *out_.torso_m) {
      out_.torso_m = distance_m;
      out_.torso_ns = at_ns;
    }
    if (distance_m <= kReachM) {
      if (!out_.reached) out_.visit = {at_ns, at_ns};
      out_.reached = true;
      out_.visit.to_ns = at_ns;
    }
    was_near_ = distance_m <= kDwellM;
  }

  void Step(const TrackPoint& a, const TrackPoint& b, TimeNs from_ns, TimeNs to_ns) {
    while (from_ns < to_ns) {
      const TimeNs next_ns = std::min(to_ns, from_ns + kStepNs);
      const bool was_near = was_near_;
      See(next_ns, PositionBetween(a, b, next_ns));
      if (was_near && was_near_) out_.dwell_s += Seconds(TimeApart(from_ns, next_ns));
      from_ns = next_ns;
    }
  }

 private:
  const Box3d& box_map_;
  Nearness& out_;
  bool was_near_ = false;
};

void MeasureTorso(const TrackPath& path, const Box3d& box_map, const Interval& during,
                  Nearness* out) {
  TorsoMeter meter(box_map, out);
  for (size_t i = 0; i < path.points.size(); ++i) {
    const TrackPoint& point = path.points[i];
    if (point.time_ns >= during.from_ns && point.time_ns <= during.to_ns) {
      meter.See(point.time_ns, point.position_map);
    }
    if (i + 1 == path.points.size() || !path.IsJoined(i)) continue;
    const TimeNs from_ns = std::max(point.time_ns, during.from_ns);
    const TimeNs to_ns = std::min(path.points[i + 1].time_ns, during.to_ns);
    if (from_ns >= to_ns) continue;
    meter.See(from_ns, PositionBetween(point, path.points[i + 1], from_ns));
    meter.Step(point, path.points[i + 1], from_ns, to_ns);
  }
}

double GapShare(const TrackPath& path, const Interval& visit) {
  if (visit.from_ns >= visit.to_ns) return 0.0;
  uint64_t gap_ns = 0;
  for (size_t i = 0; i + 1 < path.points.size(); ++i) {
    if (path.IsJoined(i)) continue;
    const TimeNs from_ns = std::max(path.points[i].time_ns, visit.from_ns);
    const TimeNs to_ns = std::min(path.points[i + 1].time_ns, visit.to_ns);
    if (from_ns < to_ns) gap_ns += TimeApart(from_ns, to_ns);
  }
  return Seconds(gap_ns) / Seconds(TimeApart(visit.from_ns, visit.to_ns));
}

absl::Status MeasureHands(const Snapshot& snapshot, NodeId agent, const Box3d& box_map,
                          const StopCheck& stop, Nearness* out) {
  absl::Status status;
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
  return snapshot.ReadShapes(agent, out->visit.from_ns, AddTime(out->visit.to_ns, 1),
                             /*with_vertices=*/false, stop, visit);
}

}  // namespace

absl::StatusOr<Nearness> MeasureNearness(const Snapshot& snapshot, const TrackInfo& track,
                                         const Box3d& box_map, const Interval& during,
                                         const StopCheck& stop) {
  Nearness result;
  DSG_ASSIGN_OR_RETURN(const TrackPath path,
                       ReadTrackPath(snapshot, track, during.from_ns, during.to_ns, stop));
  MeasureTorso(path, box_map, during, &result);
  if (!result.reached) return result;
  result.unobserved_share = GapShare(path, result.visit);
  DSG_RETURN_IF_ERROR(MeasureHands(snapshot, track.agent, box_map, stop, &result));
  return result;
}

}  // namespace dsg::query
