// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/skeleton.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {

Skeleton PlaceSkeleton(const PersonObservation& observation, const Pose3d& map_T_torso) {
  Skeleton skeleton;
  skeleton.torso = map_T_torso.position;
  skeleton.has_joints = observation.has_joints;
  if (!skeleton.has_joints) return skeleton;
  const Eigen::Matrix3d map_R_torso = map_T_torso.orientation.toRotationMatrix();
  for (int joint = 0; joint < kJointCount; ++joint) {
    skeleton.joints.col(joint) =
        map_R_torso * observation.joints_torso[static_cast<size_t>(joint)] + skeleton.torso;
  }
  return skeleton;
}

SkeletonDistance Distance(const Skeleton& a, const Skeleton& b) {
  if (!a.has_joints || !b.has_joints) {
    const double torso_m = (a.torso - b.torso).norm();
    return {torso_m, torso_m};
  }
  const Eigen::Matrix<double, 1, kJointCount> apart_m = (a.joints - b.joints).colwise().norm();
  return {apart_m.maxCoeff(), apart_m.mean()};
}

}  // namespace dsg::ingest
