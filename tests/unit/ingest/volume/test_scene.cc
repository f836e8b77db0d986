// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/volume/test_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::ingest {
namespace {

constexpr double kFarM = 40.0;
constexpr double kHitM = 1e-5;

double BoxDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& low,
                   const Eigen::Vector3d& high) {
  const Eigen::Vector3d q = (p - 0.5 * (low + high)).cwiseAbs() - 0.5 * (high - low);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

}  // namespace

TestShape Ball(const Eigen::Vector3d& center, double radius) {
  TestShape shape;
  shape.distance = [=](const Eigen::Vector3d& p) { return (p - center).norm() - radius; };
  return shape;
}

TestShape SolidBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TestShape shape;
  shape.distance = [=](const Eigen::Vector3d& p) { return BoxDistance(p, low, high); };
  return shape;
}

TestShape RoomOf(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TestShape shape;
  shape.distance = [=](const Eigen::Vector3d& p) { return -BoxDistance(p, low, high); };
  return shape;
}

double TestScene::DistanceTo(const Eigen::Vector3d& point_map) const {
  double least = kFarM;
  for (const TestShape& shape : shapes) least = std::min(least, shape.distance(point_map));
  return least;
}

DepthFrame TestScene::Render(const CameraCalibration& camera, const Pose3d& map_T_camera) const {
  DepthFrame frame;
  frame.camera = camera;
  frame.map_T_camera = map_T_camera;
  const size_t count = size_t{1} * camera.width * camera.height;
  frame.depth_m.assign(count, 0.0f);
  frame.rgb.assign(3 * count, 0);
  frame.labels.assign(count, 0);
  frame.dynamic.assign(count, 0);
  for (size_t i = 0; i < count; ++i) {
    const double column = static_cast<double>(i % camera.width);
    const double row = static_cast<double>(i / camera.width);
    const Eigen::Vector3d ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1.0);
    double depth = 0.0;
    double gap = kFarM;
    for (int step = 0; step < 200 && depth < kFarM; ++step) {
      gap = DistanceTo(map_T_camera * (ray * depth));
      if (gap < kHitM) break;
      depth += gap / ray.norm();
    }
    if (gap > 1e-3) continue;
    const Eigen::Vector3d hit = map_T_camera * (ray * depth);
    const auto shape = std::min_element(
        shapes.begin(), shapes.end(),
        [&](const TestShape& a, const TestShape& b) { return a.distance(hit) < b.distance(hit); });
    frame.depth_m[i] = static_cast<float>(depth);
    frame.labels[i] = shape->label;
    frame.dynamic[i] = shape->is_person ? 1 : 0;
    std::copy(shape->rgb.begin(), shape->rgb.end(), frame.rgb.begin() + 3 * i);
  }
  return frame;
}

CameraCalibration SmallCamera() {
  CameraCalibration camera;
  camera.name = "depth0";
  camera.width = 160;
  camera.height = 120;
  camera.fx = 92.0;
  camera.fy = 92.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

Pose3d LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d up = std::abs(forward.z()) < 0.99
                                 ? Eigen::Vector3d(Eigen::Vector3d::UnitZ())
                                 : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Eigen::Matrix3d map_R_camera;
  map_R_camera << right, forward.cross(right), forward;
  return {eye, Eigen::Quaterniond(map_R_camera).normalized()};
}

void CollectedMesh::Take(SemanticVolume* volume, double block_size_m) {
  for (MeshBlock& block : volume->TakeChangedMesh(block_size_m)) {
    std::erase_if(blocks_, [&](const MeshBlock& old) { return old.index == block.index; });
    if (!block.faces.empty()) blocks_.push_back(std::move(block));
  }
}

size_t CollectedMesh::vertex_count() const {
  size_t count = 0;
  for (const MeshBlock& block : blocks_) count += block.positions_map.size();
  return count;
}

size_t CollectedMesh::face_count() const {
  size_t count = 0;
  for (const MeshBlock& block : blocks_) count += block.faces.size();
  return count;
}

double CollectedMesh::WorstError(const TestScene& scene) const {
  double worst = 0.0;
  for (const MeshBlock& block : blocks_) {
    for (const Eigen::Vector3f& p : block.positions_map) {
      worst = std::max(worst, std::abs(scene.DistanceTo(p.cast<double>())));
    }
  }
  return worst;
}

double CollectedMesh::RmsError(const TestScene& scene) const {
  double sum = 0.0;
  for (const MeshBlock& block : blocks_) {
    for (const Eigen::Vector3f& p : block.positions_map) {
      sum += std::pow(scene.DistanceTo(p.cast<double>()), 2);
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<size_t>(vertex_count(), 1)));
}

size_t CollectedMesh::CountNear(const Eigen::Vector3d& point_map, double radius_m) const {
  size_t count = 0;
  for (const MeshBlock& block : blocks_) {
    for (const Eigen::Vector3f& p : block.positions_map) {
      if ((p.cast<double>() - point_map).norm() < radius_m) ++count;
    }
  }
  return count;
}

}  // namespace dsg::ingest
