// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/objects/shapes/shape_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "ingest/objects/shapes/surface.h"

namespace dsg::ingest {
namespace {

constexpr int kSampleCount = 60'000;
constexpr int kAzimuthCount = 360;
constexpr int kElevationCount = 180;
constexpr double kSeenToleranceM = 0.04;
constexpr double kFreeMarginM = 0.1;
constexpr double kRangeMaxM = 6.0;

void AddBox(const Box3d& box, CadModel* model) {
  const auto first = static_cast<uint32_t>(model->vertices.size());
  for (int corner = 0; corner < 8; ++corner) {
    model->vertices.emplace_back((corner & 1) != 0 ? box.max().x() : box.min().x(),
                                 (corner & 2) != 0 ? box.max().y() : box.min().y(),
                                 (corner & 4) != 0 ? box.max().z() : box.min().z());
  }
  constexpr uint32_t kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& quad : kQuads) {
    model->faces.push_back({first + quad[0], first + quad[1], first + quad[2]});
    model->faces.push_back({first + quad[0], first + quad[2], first + quad[3]});
  }
}

// Where a marching-cubes vertex may be: on a grid line along the steepest axis of the surface.
Eigen::Vector3d OnGridLine(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                           double voxel_m) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Vector3d out = (point / voxel_m).array().round() * voxel_m;
  out[axis] = point[axis];
  return out;
}

}  // namespace

CadModel BoxModel(const std::string& class_name, const std::vector<Box3d>& boxes) {
  CadModel model;
  model.name = class_name;
  model.class_name = class_name;
  for (const Box3d& box : boxes) AddBox(box, &model);
  return model;
}

CadModel BoxCouch() {
  using Eigen::Vector3d;
  return BoxModel("couch", {{Vector3d(-0.95, -0.425, 0.05), Vector3d(0.95, 0.425, 0.42)},
                            {Vector3d(-0.95, -0.425, 0.0), Vector3d(0.95, -0.2, 0.8)},
                            {Vector3d(-0.95, -0.425, 0.0), Vector3d(-0.75, 0.425, 0.6)},
                            {Vector3d(0.75, -0.425, 0.0), Vector3d(0.95, 0.425, 0.6)}});
}

size_t ShapeView::Direction(const Eigen::Vector3d& ray) {
  const double azimuth = std::atan2(ray.y(), ray.x()) / (2.0 * std::numbers::pi) + 0.5;
  const double elevation = std::acos(ray.z() / ray.norm()) / std::numbers::pi;
  const int column = std::clamp(static_cast<int>(azimuth * kAzimuthCount), 0, kAzimuthCount - 1);
  const int row = std::clamp(static_cast<int>(elevation * kElevationCount), 0, kElevationCount - 1);
  return static_cast<size_t>(row * kAzimuthCount + column);
}

ShapeView::ShapeView(const CadModel& model, const Pose3d& map_T_model,
                     const std::vector<Eigen::Vector3d>& eyes_map, const ViewOptions& options,
                     Random* random)
    : map_T_model_(map_T_model) {
  const Surface surface = SampleFaces(model, kSampleCount);
  std::set<std::array<int, 3>> voxels;
  for (const Eigen::Vector3d& eye : eyes_map) {
    DepthMap depth{eye, std::vector<float>(static_cast<size_t>(kAzimuthCount * kElevationCount),
                                           static_cast<float>(kRangeMaxM))};
    for (const Eigen::Vector3d& point : surface.points) {
      const Eigen::Vector3d ray = map_T_model * point - eye;
      float& range = depth.ranges_m[Direction(ray)];
      range = std::min(range, static_cast<float>(ray.norm()));
    }
    for (size_t i = 0; i < surface.points.size(); ++i) {
      const Eigen::Vector3d point = map_T_model * surface.points[i];
      const Eigen::Vector3d ray = point - eye;
      const Eigen::Vector3d normal = map_T_model.orientation * surface.normals[i];
      const bool is_seen = normal.dot(ray) < -0.1 * ray.norm() &&
                           ray.norm() < depth.ranges_m[Direction(ray)] + kSeenToleranceM;
      if (!is_seen) continue;
      const Eigen::Vector3d noisy =
          point + normal * (options.inflation_m + options.noise_m * random->Normal());
      const Eigen::Vector3d vertex = OnGridLine(noisy, normal, options.voxel_m);
      const Eigen::Vector3d cell = (vertex / options.voxel_m).array().floor();
      if (voxels
              .insert({static_cast<int>(cell.x()), static_cast<int>(cell.y()),
                       static_cast<int>(cell.z())})
              .second) {
        points_map_.push_back(vertex.cast<float>());
      }
    }
    depths_.push_back(std::move(depth));
  }
  const auto stray_count =
      static_cast<int>(options.stray_share * static_cast<double>(points_map_.size()));
  for (int i = 0; i < stray_count; ++i) {
    // The wall behind and the floor in front, of half a metre around.
    const bool is_wall = random->Chance(0.5);
    const Eigen::Vector3d local(random->Uniform(-1.3, 1.3),
                                is_wall ? -0.55 : random->Uniform(-0.5, 0.9),
                                is_wall ? random->Uniform(0.0, 1.2) : 0.02 * random->Normal());
    points_map_.push_back((map_T_model * local).cast<float>());
  }
}

void ShapeView::Keep(const std::function<bool(const Eigen::Vector3d&)>& test) {
  const Pose3d model_T_map = map_T_model_.Inverse();
  std::erase_if(points_map_, [&](const Eigen::Vector3f& point) {
    return !test(model_T_map * point.cast<double>());
  });
}

bool ShapeView::IsFree(const Eigen::Vector3d& point_map) const {
  if (point_map.z() < map_T_model_.position.z() + kFreeMarginM) return false;
  return std::any_of(depths_.begin(), depths_.end(), [&](const DepthMap& depth) {
    const Eigen::Vector3d ray = point_map - depth.eye_map;
    return ray.norm() < depth.ranges_m[Direction(ray)] - kFreeMarginM;
  });
}

Pose3d RandomPose(Random* random) {
  Pose3d pose;
  pose.position = {random->Uniform(-30.0, 30.0), random->Uniform(-30.0, 30.0),
                   random->Uniform(-1.0, 1.0)};
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(
      random->Uniform(-std::numbers::pi, std::numbers::pi), Eigen::Vector3d::UnitZ()));
  return pose;
}

Eigen::Vector3d EyeAround(const Pose3d& map_T_model, double azimuth_rad, double distance_m) {
  return map_T_model * Eigen::Vector3d(distance_m * std::sin(azimuth_rad),
                                       distance_m * std::cos(azimuth_rad), 1.3);
}

double YawErrorDeg(const Pose3d& a, const Pose3d& b) {
  return AngleBetween(a.orientation, b.orientation) * 180.0 / std::numbers::pi;
}

}  // namespace dsg::ingest
