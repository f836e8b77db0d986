// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/fcl_rival.h"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/default_broadphase_callbacks.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>

#include <algorithm>

namespace dsg::bench {
namespace {

using Eigen::Vector3d;

fcl::Transform3d At(const Vector3d& position) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.translation() = position;
  return transform;
}

class FclBoxes : public FclRival {
 public:
  explicit FclBoxes(const std::vector<PosedBox>& boxes) {
    for (const PosedBox& posed : boxes) {
      fcl::Transform3d transform = At(posed.map_T_box * posed.box.center());
      transform.linear() = posed.map_T_box.orientation.toRotationMatrix();
      objects_.push_back(std::make_unique<fcl::CollisionObjectd>(
          std::make_shared<fcl::Boxd>(Vector3d(posed.box.sizes())), transform));
      manager_.registerObject(objects_.back().get());
    }
    manager_.setup();
  }

  double Clearance(const Vector3d& center_map, double radius_m, double clearance_m_max) override {
    fcl::CollisionObjectd sphere(std::make_shared<fcl::Sphered>(radius_m), At(center_map));
    fcl::DefaultDistanceData<double> data;
    // Nothing further away is looked at, as with ours.
    data.result.min_distance = clearance_m_max;
    manager_.distance(&sphere, &data, fcl::DefaultDistanceFunction);
    return std::clamp(data.result.min_distance, 0.0, clearance_m_max);
  }

  bool Touches(const Vector3d& center_map, double radius_m) override {
    fcl::CollisionObjectd sphere(std::make_shared<fcl::Sphered>(radius_m), At(center_map));
    fcl::DefaultCollisionData<double> data;
    manager_.collide(&sphere, &data, fcl::DefaultCollisionFunction);
    return data.result.isCollision();
  }

 private:
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
  fcl::DynamicAABBTreeCollisionManagerd manager_;
};

class FclTriangles : public FclRival {
 public:
  explicit FclTriangles(const std::vector<Vector3d>& corners_map) {
    mesh_.beginModel(static_cast<int>(corners_map.size() / 3),
                     static_cast<int>(corners_map.size()));
    for (size_t i = 0; i + 2 < corners_map.size(); i += 3) {
      mesh_.addTriangle(corners_map[i], corners_map[i + 1], corners_map[i + 2]);
    }
    mesh_.endModel();
  }

  double Clearance(const Vector3d& center_map, double radius_m, double clearance_m_max) override {
    const fcl::Sphered sphere(radius_m);
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    result.min_distance = clearance_m_max;
    fcl::distance(&mesh_, fcl::Transform3d::Identity(), &sphere, At(center_map), request, result);
    return std::clamp(result.min_distance, 0.0, clearance_m_max);
  }

  bool Touches(const Vector3d& center_map, double radius_m) override {
    const fcl::Sphered sphere(radius_m);
    const fcl::CollisionRequestd request;
    fcl::CollisionResultd result;
    return fcl::collide(&mesh_, fcl::Transform3d::Identity(), &sphere, At(center_map), request,
                        result) > 0;
  }

 private:
  fcl::BVHModel<fcl::OBBRSSd> mesh_;
};

}  // namespace

std::unique_ptr<FclRival> FclRival::OfBoxes(const std::vector<PosedBox>& boxes) {
  return std::make_unique<FclBoxes>(boxes);
}

std::unique_ptr<FclRival> FclRival::OfTriangles(const std::vector<Vector3d>& corners_map) {
  return std::make_unique<FclTriangles>(corners_map);
}

}  // namespace dsg::bench
