// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_cameras.h"

#include <algorithm>

#include "ingest/simulator/body/life.h"
#include "ingest/simulator/motion/perturb.h"

namespace dsg::eval {
namespace {

constexpr uint64_t kGlanceStream = 701;
constexpr double kCornerInsetM = 0.2;
constexpr double kBelowCeilingM = 0.3;
constexpr double kRobotRangeM = 15.0;

const ingest::CameraCalibration& RobotCamera() {
  static const ingest::RigCalibration& rig = *new ingest::RigCalibration(simulator::ReferenceRig());
  return *rig.FindCamera("cam0");
}

bool IsInPicture(const Pose3d& map_T_camera, const Eigen::Vector3d& point_map) {
  const Eigen::Vector3d point_camera = map_T_camera.Inverse() * point_map;
  if (point_camera.z() < 0.3) return false;
  const ingest::CameraCalibration& camera = RobotCamera();
  const Eigen::Vector2d pixel = ingest::Project(camera, point_camera);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width && pixel.y() < camera.height;
}

}  // namespace

Cameras::Cameras(const simulator::World& world, const simulator::RobotMotion* robot, Tier tier,
                 const PickSensorModel& sensor, double duration_s, uint64_t seed)
    : robot_(robot) {
  if (tier == Tier::kRobot) {
    robot_sight_.emplace(world);
    return;
  }
  for (int room = 0; room < static_cast<int>(world.plan.rooms.size()); ++room) {
    AddCorner(world, room);
  }
  Random random(seed, kGlanceStream);
  if (tier == Tier::kGlances) DrawGlances(sensor, duration_s, &random);
}

// The corner from which most of the small things can be seen.
void Cameras::AddCorner(const simulator::World& world, int room) {
  const simulator::Room& here = world.plan.rooms[static_cast<size_t>(room)];
  const simulator::Rect inner = simulator::Inflate(here.Interior(), -kCornerInsetM);
  const double height_m = here.ceiling_m - kBelowCeilingM;
  const double range_m = inner.sizes().norm() + 0.5;
  const SightLines everywhere(world);
  std::optional<SightLines> best;
  int most = -1;
  for (const auto corner : {simulator::Rect::BottomLeft, simulator::Rect::BottomRight,
                            simulator::Rect::TopLeft, simulator::Rect::TopRight}) {
    const Eigen::Vector2d at = inner.corner(corner);
    SightLines sight = everywhere;
    sight.StandAt({at.x(), at.y(), height_m}, range_m);
    const auto is_seen = [&](const simulator::Furniture& item) {
      return item.room == room && item.on >= 0 && sight.IsClear(item.center, {}, -1);
    };
    const auto count =
        static_cast<int>(std::count_if(world.furniture.begin(), world.furniture.end(), is_seen));
    if (count <= most) continue;
    most = count;
    best = std::move(sight);
  }
  corners_.push_back({*std::move(best), {}, true});
}

void Cameras::DrawGlances(const PickSensorModel& sensor, double duration_s, Random* random) {
  for (Corner& corner : corners_) {
    double at_s = random->Uniform(0.0, sensor.pause_s_max);
    while (at_s < duration_s) {
      corner.turns_ns.push_back(simulator::NsOf(at_s));
      corner.turns_ns.push_back(simulator::NsOf(at_s + sensor.glance_s));
      at_s += sensor.glance_s + random->Uniform(sensor.pause_s_min, sensor.pause_s_max);
    }
  }
}

void Cameras::SetTime(TimeNs at_ns) {
  if (robot_ != nullptr && robot_sight_.has_value()) {
    map_T_camera_ = robot_->StateAt(at_ns).map_T_body * RobotCamera().body_T_camera;
    robot_sight_->StandAt(map_T_camera_.position, kRobotRangeM);
  }
  for (Corner& corner : corners_) {
    if (corner.turns_ns.empty()) continue;
    const auto next = std::upper_bound(corner.turns_ns.begin(), corner.turns_ns.end(), at_ns);
    corner.is_looking = (next - corner.turns_ns.begin()) % 2 == 1;
  }
}

bool Cameras::Sees(int room, const Eigen::Vector3d& point_map, double range_m,
                   const std::vector<Blocker>& bodies, int own) const {
  if (robot_sight_.has_value()) {
    return (point_map - map_T_camera_.position).norm() <= range_m &&
           IsInPicture(map_T_camera_, point_map) && robot_sight_->IsClear(point_map, bodies, own);
  }
  if (room < 0) return false;
  const Corner& corner = corners_[static_cast<size_t>(room)];
  return corner.is_looking && corner.sight.IsClear(point_map, bodies, own);
}

}  // namespace dsg::eval
