// SPDX-License-Identifier: Apache-2.0
// Furniture made of boxes, and what a camera and a volume of voxels would make of it.
// Refuses to render: points stand for pixels, and a map of directions for the depth image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "ingest/objects/shapes/cad_model.h"
#include "schema/base/random.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A CAD model of boxes, faces outwards; the boxes may overlap.
CadModel BoxModel(const std::string& class_name, const std::vector<Box3d>& boxes);

/// 1.9 x 0.85 x 0.8 m, back at -y.
CadModel BoxCouch();

struct ViewOptions {
  double voxel_m = 0.05;
  /// Of each point, and outwards of all of them (a surface in a volume of voxels is fatter).
  double noise_m = 0.015;
  double inflation_m = 0.02;
  /// Points of something else around the model, as a share of its own.
  double stray_share = 0.0;
};

/// A model that stands at `map_T_model`, seen from several points.
class ShapeView {
 public:
  ShapeView(const CadModel& model, const Pose3d& map_T_model,
            const std::vector<Eigen::Vector3d>& eyes_map, const ViewOptions& options,
            Random* random);

  const std::vector<Eigen::Vector3f>& points_map() const { return points_map_; }
  /// Keeps the points that `test` likes, in the model's frame.
  void Keep(const std::function<bool(const Eigen::Vector3d&)>& test);
  /// Some eye saw past the point by 0.1 m.
  bool IsFree(const Eigen::Vector3d& point_map) const;

 private:
  struct DepthMap {
    Eigen::Vector3d eye_map;
    std::vector<float> ranges_m;
  };
  static size_t Direction(const Eigen::Vector3d& ray);

  Pose3d map_T_model_;
  std::vector<DepthMap> depths_;
  std::vector<Eigen::Vector3f> points_map_;
};

/// Upright, anywhere in a building.
Pose3d RandomPose(Random* random);
/// At eye height, `distance_m` away from the model's middle, `azimuth_rad` from its front (+y).
Eigen::Vector3d EyeAround(const Pose3d& map_T_model, double azimuth_rad, double distance_m);

double YawErrorDeg(const Pose3d& a, const Pose3d& b);

}  // namespace dsg::ingest
