// SPDX-License-Identifier: Apache-2.0
// Labelled depth pictures of boxes, made by casting rays.
// Refuses noise: a test adds the one that it is about.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/sensor/depth_frame.h"
#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {

inline constexpr int32_t kBook = 23;
inline constexpr int32_t kPerson = 90;

struct MadeBox {
  int32_t class_id = 0;
  /// 0 = none.
  int32_t instance = 0;
  Box3d box_map;
};

inline MadeBox MakeBox(int32_t class_id, int32_t instance, const Eigen::Vector3d& foot_map,
                       const Eigen::Vector3d& size) {
  const Eigen::Vector3d half(0.5 * size.x(), 0.5 * size.y(), 0.0);
  return {class_id, instance,
          Box3d(foot_map - half, foot_map + half + Eigen::Vector3d(0, 0, size.z()))};
}

/// 8 cm wide and high.
inline MadeBox MakeCup(int32_t instance, const Eigen::Vector3d& foot_map) {
  return MakeBox(kCup, instance, foot_map, {0.08, 0.08, 0.08});
}

/// 1.2 m x 0.8 m, its top 0.75 m above the floor.
inline MadeBox MakeTable() { return MakeBox(kTable, 1, {0, 0, 0.7}, {1.2, 0.8, 0.05}); }

/// A camera looks at a point.
inline Pose3d LookAt(const Eigen::Vector3d& camera_map, const Eigen::Vector3d& target_map) {
  Eigen::Matrix3d axes;
  axes.col(2) = (target_map - camera_map).normalized();
  axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {camera_map, Eigen::Quaterniond(axes)};
}

/// Where a ray enters a box, in units of its direction; 0 = nowhere.
inline double EntryOf(const Eigen::Vector3d& start, const Eigen::Vector3d& way, const Box3d& box) {
  double from = 0.0, to = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    double near = (box.min()[axis] - start[axis]) / way[axis];
    double far = (box.max()[axis] - start[axis]) / way[axis];
    if (near > far) std::swap(near, far);
    from = std::max(from, near);
    to = std::min(to, far);
  }
  return from < to ? from : 0.0;
}

/// 640 x 480, the floor at height 0 and the boxes above it. People are dynamic.
inline DepthFrame MakePicture(TimeNs time_ns, const Pose3d& map_T_camera,
                              const std::vector<MadeBox>& boxes) {
  DepthFrame frame;
  frame.time_ns = time_ns;
  frame.map_T_camera = map_T_camera;
  frame.camera.width = 640;
  frame.camera.height = 480;
  frame.camera.fx = frame.camera.fy = 415.0;
  frame.camera.cx = 320.0;
  frame.camera.cy = 240.0;
  const size_t count = 640 * 480;
  frame.depth_m.assign(count, 0.0F);
  frame.labels.assign(count, 0);
  frame.dynamic.assign(count, 0);
  for (int row = 0; row < 480; ++row) {
    for (int column = 0; column < 640; ++column) {
      const Eigen::Vector3d way =
          map_T_camera.orientation *
          Eigen::Vector3d((column - 320.0) / 415.0, (row - 240.0) / 415.0, 1);
      double depth_m = way.z() < 0.0 ? -map_T_camera.position.z() / way.z() : 0.0;
      int32_t label = depth_m > 0.0 ? kFloor << 8 : 0;
      for (const MadeBox& box : boxes) {
        const double entry = EntryOf(map_T_camera.position, way, box.box_map);
        if (entry <= 0.0 || (depth_m > 0.0 && entry >= depth_m)) continue;
        depth_m = entry;
        label = box.class_id << 8 | box.instance;
      }
      const auto pixel = static_cast<size_t>(row * 640 + column);
      frame.depth_m[pixel] = static_cast<float>(depth_m);
      frame.labels[pixel] = static_cast<uint16_t>(label);
      frame.dynamic[pixel] = label >> 8 == kPerson ? 1 : 0;
    }
  }
  return frame;
}

}  // namespace dsg::ingest
