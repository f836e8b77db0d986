// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/map_mover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "schema/model/rigid_motion.h"

namespace dsg::ingest {
namespace {

// Axes nearer to the vertical than this count as upright.
constexpr double kUprightCosine = 0.9998;

bool IsUpright(const Eigen::Quaterniond& orientation) {
  return (orientation * Eigen::Vector3d::UnitZ()).z() > kUprightCosine;
}

// The share of a rotation that a node without a tilt takes.
Pose3d Levelled(const Pose3d& new_T_old, const Eigen::Vector3d& at_map) {
  const Eigen::Quaterniond turn = TurnAboutZ(YawOf(new_T_old.orientation));
  return {new_T_old * at_map - turn * at_map, turn};
}

Pose3d ShiftAsRobot(const Eigen::Vector3d& at_map, const TrajectoryChange& change,
                    const std::vector<TimedPose>& robot) {
  double nearest_m2 = std::numeric_limits<double>::infinity();
  TimeNs time_ns = 0;
  for (const TimedPose& pose : robot) {
    const double distance_m2 = (pose.map_T_agent.position - at_map).squaredNorm();
    if (distance_m2 >= nearest_m2) continue;
    nearest_m2 = distance_m2;
    time_ns = pose.time_ns;
  }
  if (robot.empty()) return {};
  return Levelled(change.At(time_ns), at_map);
}

// new_T_old of one node.
Pose3d ShiftOf(const Node& node, const TrajectoryChange& change, const MapShift& shift,
               const std::vector<TimedPose>& robot) {
  if (node.first_observed_ns.has_value() && node.last_observed_ns.has_value()) {
    const Pose3d moved =
        MovePose(node.map_T_node, *node.first_observed_ns, *node.last_observed_ns, change);
    return KeepUpright(node.map_T_node, moved) * node.map_T_node.Inverse();
  }
  if (const std::optional<Pose3d> around = shift.Around(node.BoxMap())) return *around;
  return ShiftAsRobot(node.map_T_node.position, change, robot);
}

bool HoldsRooms(const Node& node) {
  return node.region.has_value() && node.layer != layers::kRooms;
}

// Buildings and levels are boxes around all that was found, and are made so again.
void BoxHolders(std::vector<Node>* nodes) {
  Box3d whole;
  for (const Node& node : *nodes) {
    if (!HoldsRooms(node)) whole.extend(node.BoxMap());
  }
  if (whole.isEmpty()) return;
  for (Node& node : *nodes) {
    if (!HoldsRooms(node)) continue;
    Box3d box = whole;
    if (node.layer != layers::kBuildings) {
      box.min().z() = node.region->z_min_m;
      box.max().z() = node.region->z_max_m;
    }
    node.map_T_node = {box.center(), Eigen::Quaterniond::Identity()};
    node.map_T_node.position.z() = box.min().z();
    node.box_node =
        Box3d(box.min() - node.map_T_node.position, box.max() - node.map_T_node.position);
    node.region->z_min_m = box.min().z();
    node.region->z_max_m = box.max().z();
    node.region->footprint_map = {{box.min().x(), box.min().y()},
                                  {box.max().x(), box.min().y()},
                                  {box.max().x(), box.max().y()},
                                  {box.min().x(), box.max().y()}};
  }
}

// Covariances by keyframe, shared by the poses around it.
class KeyframeCovariances {
 public:
  explicit KeyframeCovariances(const MovePosesOptions& options) : times_(options.keyframe_times) {
    for (const Covariance6& covariance : options.covariances) {
      shared_.push_back(std::make_shared<const Covariance6>(covariance));
    }
  }

  bool empty() const { return times_.empty() || shared_.size() != times_.size(); }

  const std::shared_ptr<const Covariance6>& Nearest(TimeNs time_ns) const {
    const auto after = std::lower_bound(times_.begin(), times_.end(), time_ns);
    auto index = static_cast<size_t>(after - times_.begin());
    const bool is_before_nearer =
        index == times_.size() || (index > 0 && time_ns - times_[index - 1] < *after - time_ns);
    if (is_before_nearer) --index;
    return shared_[index];
  }

 private:
  const std::vector<TimeNs>& times_;
  std::vector<std::shared_ptr<const Covariance6>> shared_;
};

}  // namespace

Pose3d MovePose(const Pose3d& map_T_thing, TimeNs first_ns, TimeNs last_ns,
                const TrajectoryChange& change) {
  const Pose3d by_first = change.At(first_ns) * map_T_thing;
  if (first_ns == last_ns) return by_first;
  return Interpolate(by_first, change.At(last_ns) * map_T_thing, 0.5);
}

Pose3d KeepUpright(const Pose3d& old_pose, const Pose3d& new_pose) {
  if (!IsUpright(old_pose.orientation)) return new_pose;
  const double yaw_rad = YawOf(new_pose.orientation * old_pose.orientation.conjugate());
  return {new_pose.position, (TurnAboutZ(yaw_rad) * old_pose.orientation).normalized()};
}

LayerGraph MoveGraph(LayerGraph graph, const TrajectoryChange& change, const MapShift& shift,
                     const std::vector<TimedPose>& robot) {
  if (change.IsIdentity()) return graph;
  for (Node& node : graph.nodes) {
    TransformNode(ShiftOf(node, change, shift, robot), &node);
  }
  BoxHolders(&graph.nodes);
  // Children moved apart from their parents.
  GraphDelta whole;
  whole.nodes = std::move(graph.nodes);
  whole.edges = std::move(graph.edges);
  FitBoxesToChildren(&whole);
  return {std::move(whole.nodes), std::move(whole.edges)};
}

std::vector<TimedPose> MovePoses(std::vector<TimedPose> poses, const TrajectoryChange& change,
                                 const MovePosesOptions& options) {
  if (change.IsIdentity()) return poses;
  const KeyframeCovariances covariances(options);
  for (TimedPose& pose : poses) {
    const Pose3d old_pose = pose.map_T_agent;
    if (!covariances.empty()) pose.covariance = nullptr;
    TransformPose(change.At(pose.time_ns), &pose);
    if (options.is_kept_upright) pose.map_T_agent = KeepUpright(old_pose, pose.map_T_agent);
    pose.flags |= pose_flags::kCorrected;
    if (!covariances.empty()) pose.covariance = covariances.Nearest(pose.time_ns);
  }
  return poses;
}

}  // namespace dsg::ingest
