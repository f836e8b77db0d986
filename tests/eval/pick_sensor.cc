// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_sensor.h"

#include <algorithm>
#include <limits>

namespace dsg::eval {
namespace {

// What is nearer to a box than this is part of it.
constexpr double kPartM = 0.03;

bool Crosses(const Box3d& box, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  double low = 0.0, high = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    if (way == 0.0) {
      if (from[axis] < box.min()[axis] || from[axis] > box.max()[axis]) return false;
      continue;
    }
    const double a = (box.min()[axis] - from[axis]) / way;
    const double b = (box.max()[axis] - from[axis]) / way;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

bool Hides(const Blocker& body, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector2d way = (to - from).head<2>();
  const double length2 = way.squaredNorm();
  if (length2 == 0.0) return false;
  const double share = std::clamp((body.at_map - from.head<2>()).dot(way) / length2, 0.0, 1.0);
  const Eigen::Vector3d nearest = from + share * (to - from);
  return nearest.z() < body.height_m && (nearest.head<2>() - body.at_map).norm() < body.radius_m;
}

Box3d Upright(const simulator::Rect& rect, double low_m, double high_m) {
  return Box3d(Eigen::Vector3d(rect.min().x(), rect.min().y(), low_m),
               Eigen::Vector3d(rect.max().x(), rect.max().y(), high_m));
}

}  // namespace

SightLines::SightLines(const simulator::World& world) {
  for (const simulator::Structure& part : world.plan.structures) {
    if (part.type == "wall" || part.type == "pillar") {
      boxes_.push_back(Upright(part.rect, part.z_min_m, part.z_max_m));
    }
  }
  for (const simulator::Furniture& item : world.furniture) {
    if (!item.StandsOnFloor()) continue;
    boxes_.push_back(
        Upright(item.Footprint(), item.BaseM(), item.center.z() + 0.5 * item.size.z()));
  }
}

void SightLines::StandAt(const Eigen::Vector3d& eye_map, double range_m) {
  eye_map_ = eye_map;
  near_.clear();
  for (const Box3d& box : boxes_) {
    if (box.exteriorDistance(eye_map) <= range_m) near_.push_back(box);
  }
}

bool SightLines::IsClear(const Eigen::Vector3d& to_map, const std::vector<Blocker>& bodies,
                         int own) const {
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (static_cast<int>(i) != own && Hides(bodies[i], eye_map_, to_map)) return false;
  }
  return std::none_of(near_.begin(), near_.end(), [&](const Box3d& box) {
    return box.exteriorDistance(to_map) > kPartM && Crosses(box, eye_map_, to_map);
  });
}

}  // namespace dsg::eval
