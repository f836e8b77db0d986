// SPDX-License-Identifier: Apache-2.0
// Where a body of known joints stands before a camera, from the pixels of its joints.
// Refuses to know which joints are worth it; the weights say so.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "ingest/agents/detections/cue_options.h"

namespace dsg::ingest {

/// A joint and the ray on which it is seen.
struct SeenJoint {
  /// Axes of the camera, minus the root, metres.
  Eigen::Vector3d root = Eigen::Vector3d::Zero();
  /// x and y at z = 1, distortion taken off.
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  double weight = 1.0;
};

struct BodyPlacement {
  Eigen::Vector3d root_camera = Eigen::Vector3d::Zero();
  /// Of the joints about the root; identity unless refined.
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  double reprojection_px = 0.0;
};

inline constexpr int kPnpJointsMin = 4;

/// Translation alone: linear, reweighted with Huber's weights. nullopt when fewer than
/// kPnpJointsMin joints have a weight, or they do not tell the distance. May lie behind the
/// camera, as mirrored joints do.
std::optional<BodyPlacement> PlaceByTranslation(const std::vector<SeenJoint>& joints,
                                                double focal_px, const PlacementOptions& options);

/// All six degrees of freedom from `start` on; nullopt unless it reprojects better in front of the
/// camera without turning the body by `turn_rad_max` or more.
std::optional<BodyPlacement> RefineSixDof(const std::vector<SeenJoint>& joints, double focal_px,
                                          const BodyPlacement& start, double turn_rad_max);

/// Root of the weighted mean square, pixels; infinite when a joint is behind the camera.
double ReprojectionPx(const std::vector<SeenJoint>& joints, double focal_px,
                      const Eigen::Vector3d& root_camera, const Eigen::Quaterniond& turn);

}  // namespace dsg::ingest
