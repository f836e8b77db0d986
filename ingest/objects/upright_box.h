// SPDX-License-Identifier: Apache-2.0
// The upright box with the least footprint around points, of which a few may be wrong.
// Refuses to turn for little: without a clear gain the box stays along the axes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ingest/objects/object_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct UprightBox {
  /// Of its centre; yaw only.
  Pose3d map_T_box;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
};

/// A point that stands for some share of a surface.
struct WeightedPoint {
  Eigen::Vector3f point_map = Eigen::Vector3f::Zero();
  float weight = 1.0f;
};

/// Radians in (-pi/4, pi/4]; 0 unless the footprint gets clearly smaller by turning.
/// Cost: some 60 passes over the points, at most 500 of them.
double LeastFootprintYaw(const std::vector<Eigen::Vector3f>& points,
                         const BoxOptions& options = {});

/// Leaves out some of the weight at either end of each axis. Requires: points, weights above 0.
UprightBox FitUprightBox(const std::vector<WeightedPoint>& points, double yaw_rad,
                         const BoxOptions& options = {});

/// The same box with its lower side at `z_m`.
void ExtendDownTo(double z_m, UprightBox* box);

}  // namespace dsg::ingest
