// SPDX-License-Identifier: Apache-2.0
// An articulated human body of our own: 24 joints in SMPL's order, ten shape coefficients, a
// closed skin. Refuses to know where it walks.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "ingest/sensor/human_detection.h"
#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

/// Of the ankle joints above the soles.
inline constexpr double kAnkleHeightM = 0.08;

/// Standard deviations from the mean body: height, girths, limb ratios; normal, mean 0.
using ShapeCoefficients = std::array<double, ingest::kShapeCount>;

/// How the body is bent.
struct Posture {
  /// Of the pelvis against the torso frame (x forward, z up), metres: bob and sway of the gait.
  Eigen::Vector3d pelvis_offset = Eigen::Vector3d::Zero();
  /// Each joint against its parent; the pelvis against the torso frame. Identity everywhere =
  /// standing upright, arms hanging.
  std::array<Eigen::Quaterniond, ingest::kJointCount> rotations;

  Posture() { rotations.fill(Eigen::Quaterniond::Identity()); }
};

/// Parent of each joint, -1 for the pelvis.
const std::array<int, ingest::kJointCount>& JointParents();

/// Where each joint is and how its bones are turned, torso frame.
struct JointFrames {
  std::array<Eigen::Vector3d, ingest::kJointCount> positions;
  std::array<Eigen::Quaterniond, ingest::kJointCount> rotations;
};

/// How thick the body is against the mean one.
struct Girths {
  double trunk_width = 1.0;
  double trunk_depth = 1.0;
  double limb = 1.0;
  double head = 1.0;
  /// Of hands and feet.
  double extremity = 1.0;
};

/// Threads: safe; immutable.
class BodyModel {
 public:
  /// The first coefficient alone decides the height: 1.72 m + 0.087 m each. The others share the
  /// height out between legs and trunk, and change girths; a tall body is a little wider.
  explicit BodyModel(const ShapeCoefficients& shape);

  const ShapeCoefficients& shape() const { return shape_; }
  double height_m() const { return height_m_; }
  /// Of the pelvis above the floor when standing upright.
  double pelvis_height_m() const { return pelvis_height_m_; }
  /// From the parent in the rest pose, metres.
  const Eigen::Vector3d& offset(int joint) const { return offsets_[joint]; }
  JointFrames Frames(const Posture& posture) const;
  /// Joints in the torso frame (origin at the standing pelvis).
  std::array<Eigen::Vector3d, ingest::kJointCount> Joints(const Posture& posture) const;
  /// About 1600 vertices and 3200 triangles in the torso frame; the same topology for everyone,
  /// each limb a closed surface. Cost: below a millisecond.
  void Skin(const Posture& posture, TriangleMesh* mesh) const;
  /// Joints bound to the vertices: index of the joint that moves each vertex most.
  static const std::vector<uint8_t>& VertexJoints();

 private:
  ShapeCoefficients shape_;
  double height_m_ = 0.0;
  double pelvis_height_m_ = 0.0;
  Girths girths_;
  /// Of each joint from its parent in the rest pose, metres.
  std::array<Eigen::Vector3d, ingest::kJointCount> offsets_;
  std::array<Eigen::Vector3d, ingest::kJointCount> rest_joints_;
  std::vector<Eigen::Vector3d> rest_vertices_;
};

}  // namespace dsg::simulator
