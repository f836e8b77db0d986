// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/limb_ik.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

/// A limb never stretches quite: the bend would have no direction.
constexpr double kStretchMax = 0.9995;

/// A limb of two rigid bones.
struct Bones {
  int upper = 0;
  int lower = 0;
  /// In the frames of their joints, metres.
  Eigen::Vector3d upper_bone;
  Eigen::Vector3d lower_bone;
  /// Where the middle joint points at rest.
  Eigen::Vector3d rest_bend;
};

Bones LegBones(const BodyModel& body, Side side) {
  const int i = static_cast<int>(side);
  return {1 + i, 4 + i, body.offset(4 + i), body.offset(7 + i), Eigen::Vector3d::UnitX()};
}

// The wrist stays straight, so the hand belongs to the lower bone.
Bones ArmBones(const BodyModel& body, Side side) {
  const int i = static_cast<int>(side);
  return {16 + i, 18 + i, body.offset(18 + i), body.offset(20 + i) + body.offset(22 + i),
          -Eigen::Vector3d::UnitX()};
}

// The axes of a bone: along it, its hinge, and the third.
Eigen::Matrix3d BoneAxes(const Eigen::Vector3d& along, const Eigen::Vector3d& hinge) {
  Eigen::Matrix3d axes;
  axes.col(0) = along.normalized();
  axes.col(1) = (hinge - axes.col(0).dot(hinge) * axes.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

Eigen::Quaterniond Turn(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  return Eigen::Quaterniond(Eigen::Matrix3d(to * from.transpose())).normalized();
}

// Returns the rotation of the lower bone against the torso.
Eigen::Quaterniond Solve(const BodyModel& body, const Bones& bones, const Eigen::Vector3d& target,
                         const Eigen::Vector3d& bend, Posture* posture) {
  const JointFrames frames = body.Frames(*posture);
  const Eigen::Vector3d& root = frames.positions[bones.upper];
  const double upper_m = bones.upper_bone.norm();
  const double lower_m = bones.lower_bone.norm();
  const Eigen::Vector3d to_target = target - root;
  const double far_m = kStretchMax * (upper_m + lower_m);
  const double near_m = std::abs(upper_m - lower_m) + 0.02;
  const double distance_m = std::clamp(to_target.norm(), near_m, far_m);
  const Eigen::Vector3d along = to_target.normalized();
  const Eigen::Vector3d aside = (bend - bend.dot(along) * along).normalized();
  const double cosine = (upper_m * upper_m + distance_m * distance_m - lower_m * lower_m) /
                        (2.0 * upper_m * distance_m);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const Eigen::Vector3d middle = upper_m * (cosine * along + sine * aside);
  const Eigen::Vector3d hinge = along.cross(aside);
  const Eigen::Vector3d rest_hinge = bones.upper_bone.normalized().cross(bones.rest_bend);
  const Eigen::Quaterniond upper =
      Turn(BoneAxes(bones.upper_bone, rest_hinge), BoneAxes(middle, hinge));
  const Eigen::Quaterniond lower =
      Turn(BoneAxes(bones.lower_bone, rest_hinge), BoneAxes(distance_m * along - middle, hinge));
  const Eigen::Quaterniond& trunk = frames.rotations[JointParents()[bones.upper]];
  posture->rotations[bones.upper] = trunk.conjugate() * upper;
  posture->rotations[bones.lower] = upper.conjugate() * lower;
  return lower;
}

}  // namespace

double LegLengthM(const BodyModel& body) { return body.offset(4).norm() + body.offset(7).norm(); }

double ArmLengthM(const BodyModel& body) {
  return body.offset(18).norm() + (body.offset(20) + body.offset(22)).norm();
}

void PutAnkle(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso,
              double foot_pitch_rad, Posture* posture) {
  const Eigen::Quaterniond shank =
      Solve(body, LegBones(body, side), target_torso, Eigen::Vector3d::UnitX(), posture);
  const Eigen::Quaterniond foot(Eigen::AngleAxisd(foot_pitch_rad, Eigen::Vector3d::UnitY()));
  posture->rotations[AnkleJoint(side)] = shank.conjugate() * foot;
}

void PutHand(const BodyModel& body, Side side, const Eigen::Vector3d& target_torso,
             Posture* posture) {
  const double out = side == Side::kLeft ? 1.0 : -1.0;
  const Eigen::Vector3d bend(-0.35, 0.55 * out, -0.75);
  Solve(body, ArmBones(body, side), target_torso, bend, posture);
  posture->rotations[20 + static_cast<int>(side)].setIdentity();
  posture->rotations[HandJoint(side)].setIdentity();
}

}  // namespace dsg::simulator
