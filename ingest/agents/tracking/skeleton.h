// SPDX-License-Identifier: Apache-2.0
// A body's joints in the map, and how far two bodies are apart.
// Refuses to know whose they are.
#pragma once

#include <Eigen/Core>
#include <array>

#include "ingest/agents/person_observation.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Frames: map.
struct Skeleton {
  Eigen::Vector3d torso = Eigen::Vector3d::Zero();
  bool has_joints = false;
  Eigen::Matrix<double, 3, kJointCount> joints;
};

/// The joints of `observation` about a torso at `map_T_torso`.
Skeleton PlaceSkeleton(const PersonObservation& observation, const Pose3d& map_T_torso);

struct SkeletonDistance {
  double largest_m = 0.0;
  double mean_m = 0.0;
};

/// Over all joints; between the torsos when one has no joints.
SkeletonDistance Distance(const Skeleton& a, const Skeleton& b);

}  // namespace dsg::ingest
