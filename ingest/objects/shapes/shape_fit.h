// SPDX-License-Identifier: Apache-2.0
// Finds the pose of a known shape in the points of an object.
// Refuses to please: a fit that the surface or the free space around it contradicts is no fit.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/shape_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// An accepted fit.
struct ShapeFit {
  /// Index in the catalogue.
  int model = -1;
  Pose3d map_T_model;
  /// Root mean square distance to the model of the object's points near it, metres.
  double residual_m = 0.0;
  /// Share of the object's points near the model.
  double inlier_share = 0.0;
  /// Share of the model's surface in free space.
  double free_share = 0.0;
};

/// A catalogue made ready: resampled surfaces, keypoints, nearest-point indices.
///
/// Threads: safe from many threads.
class ShapeFitter {
 public:
  ShapeFitter(const std::vector<CadModel>& catalogue, const ShapeOptions& options);
  ~ShapeFitter();
  ShapeFitter(ShapeFitter&&) noexcept;
  ShapeFitter& operator=(ShapeFitter&&) noexcept;

  /// The best accepted fit among the models of `class_name`; nullopt when there is none.
  /// `is_free(point_map)`: the point was seen to be empty, with a margin of a voxel or more to any
  /// surface; may be empty. `floor_z_map`: what the object stands on, when it is known.
  /// Cost: 0.2 s an object. Order: the same input gives the same fit.
  /// Source: RSS 2020, section IV-B (objects with known shape).
  std::optional<ShapeFit> Fit(const std::string& class_name,
                              const std::vector<Eigen::Vector3f>& points_map,
                              const std::function<bool(const Eigen::Vector3d&)>& is_free,
                              std::optional<double> floor_z_map = std::nullopt) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
