// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/body_model.h"

#include <algorithm>

#include "ingest/sensor/skeleton.h"
#include "ingest/simulator/body/body_skin.h"

namespace dsg::simulator {
namespace {

using Offsets = std::array<Eigen::Vector3d, ingest::kJointCount>;

constexpr double kMeanHeightM = 1.72;
/// Three of them keep a body between 1.45 and 2.05 m.
constexpr double kHeightPerCoefficientM = 0.087;
constexpr double kHeadJointToTopM = 0.17;

// Our own mean body, standing, arms hanging: metres, x forward, y left, z up.
Offsets MeanOffsets() {
  Offsets offsets;
  offsets[0] = Eigen::Vector3d::Zero();
  offsets[1] = {0.0, 0.09, -0.07};
  offsets[3] = {-0.01, 0.0, 0.11};
  offsets[4] = {0.005, 0.0, -0.40};
  offsets[6] = {0.0, 0.0, 0.13};
  offsets[7] = {-0.015, 0.0, -0.40};
  offsets[9] = {0.0, 0.0, 0.06};
  offsets[10] = {0.13, 0.01, -0.055};
  offsets[12] = {0.0, 0.0, 0.21};
  offsets[13] = {0.0, 0.07, 0.12};
  offsets[15] = {0.01, 0.0, 0.09};
  offsets[16] = {0.0, 0.115, 0.02};
  offsets[18] = {0.0, 0.03, -0.275};
  offsets[20] = {0.012, 0.0, -0.25};
  offsets[22] = {0.010, 0.0, -0.085};
  // The right side mirrors the left.
  for (const int left : {1, 4, 7, 10, 13, 16, 18, 20, 22}) {
    offsets[left + 1] = offsets[left].cwiseProduct(Eigen::Vector3d(1.0, -1.0, 1.0));
  }
  return offsets;
}

double Factor(double change) { return std::clamp(1.0 + change, 0.55, 1.6); }

void ScaleJoints(std::initializer_list<int> joints, const Eigen::Vector3d& factor,
                 Offsets* offsets) {
  for (const int joint : joints) (*offsets)[joint] = (*offsets)[joint].cwiseProduct(factor);
}

// The shape but for the height, which the caller restores.
Offsets Proportioned(const ShapeCoefficients& c) {
  Offsets offsets = MeanOffsets();
  const double leg = Factor(0.025 * c[2]);
  const double trunk = Factor(-0.02 * c[2]);
  const double arm = Factor(0.025 * c[3] + 0.005 * c[2]);
  const double shoulders = Factor(0.04 * c[4] + 0.01 * c[1]);
  const double hips = Factor(0.04 * c[5] + 0.01 * c[1]);
  const double upper = Factor(0.015 * c[9]);
  const double lower = Factor(-0.015 * c[9]);
  ScaleJoints({1, 2}, {1.0, hips, leg}, &offsets);
  ScaleJoints({4, 5}, Eigen::Vector3d::Constant(leg * upper), &offsets);
  ScaleJoints({7, 8}, Eigen::Vector3d::Constant(leg * lower), &offsets);
  ScaleJoints({3, 6, 9, 12}, Eigen::Vector3d::Constant(trunk), &offsets);
  ScaleJoints({13, 14, 16, 17}, {1.0, shoulders, trunk}, &offsets);
  ScaleJoints({18, 19}, Eigen::Vector3d::Constant(arm * upper), &offsets);
  ScaleJoints({20, 21}, Eigen::Vector3d::Constant(arm * lower), &offsets);
  return offsets;
}

Girths GirthsOf(const ShapeCoefficients& c) {
  Girths girths;
  girths.trunk_width = Factor(0.06 * c[1] + 0.015 * c[0]);
  girths.trunk_depth = Factor(0.08 * c[1] + 0.04 * c[6] + 0.015 * c[0]);
  girths.limb = Factor(0.05 * c[1] + 0.04 * c[7]);
  girths.head = Factor(0.025 * c[8]);
  girths.extremity = Factor(0.02 * c[1] + 0.02 * c[7]);
  return girths;
}

}  // namespace

const std::array<int, ingest::kJointCount>& JointParents() { return ingest::kJointParents; }

BodyModel::BodyModel(const ShapeCoefficients& shape)
    : shape_(shape), girths_(GirthsOf(shape)), offsets_(Proportioned(shape)) {
  const double legs = -(offsets_[1].z() + offsets_[4].z() + offsets_[7].z()) + kAnkleHeightM;
  const double trunk = offsets_[3].z() + offsets_[6].z() + offsets_[9].z() + offsets_[12].z() +
                       offsets_[15].z() + girths_.head * kHeadJointToTopM;
  height_m_ = std::clamp(kMeanHeightM + kHeightPerCoefficientM * shape[0], 1.2, 2.3);
  const double scale = height_m_ / (legs + trunk);
  pelvis_height_m_ = scale * legs;
  for (Eigen::Vector3d& offset : offsets_) offset *= scale;
  rest_joints_ = Joints(Posture());
  rest_vertices_ = RestVertices(rest_joints_, girths_, scale);
}

JointFrames BodyModel::Frames(const Posture& posture) const {
  JointFrames frames;
  frames.positions[0] = posture.pelvis_offset;
  frames.rotations[0] = posture.rotations[0];
  for (int j = 1; j < ingest::kJointCount; ++j) {
    const int parent = JointParents()[j];
    frames.positions[j] = frames.positions[parent] + frames.rotations[parent] * offsets_[j];
    frames.rotations[j] = frames.rotations[parent] * posture.rotations[j];
  }
  return frames;
}

std::array<Eigen::Vector3d, ingest::kJointCount> BodyModel::Joints(const Posture& posture) const {
  return Frames(posture).positions;
}

void BodyModel::Skin(const Posture& posture, TriangleMesh* mesh) const {
  const JointFrames frames = Frames(posture);
  std::array<Eigen::Matrix3d, ingest::kJointCount> turns;
  for (int j = 0; j < ingest::kJointCount; ++j) turns[j] = frames.rotations[j].toRotationMatrix();
  const SkinTopology& topology = SkinTopologyOfAll();
  const auto moved = [&](const Eigen::Vector3d& at, uint8_t j) -> Eigen::Vector3d {
    return frames.positions[j] + turns[j] * (at - rest_joints_[j]);
  };
  mesh->faces = topology.faces;
  mesh->vertices.resize(rest_vertices_.size());
  for (size_t i = 0; i < rest_vertices_.size(); ++i) {
    const SkinBinding& binding = topology.bindings[i];
    Eigen::Vector3d at = moved(rest_vertices_[i], binding.joint);
    if (binding.weight > 0.0) {
      at += binding.weight * (moved(rest_vertices_[i], binding.second) - at);
    }
    mesh->vertices[i] = at.cast<float>();
  }
}

const std::vector<uint8_t>& BodyModel::VertexJoints() {
  static const std::vector<uint8_t> joints = [] {
    std::vector<uint8_t> out;
    for (const SkinBinding& binding : SkinTopologyOfAll().bindings) {
      out.push_back(binding.weight > 0.5 ? binding.second : binding.joint);
    }
    return out;
  }();
  return joints;
}

}  // namespace dsg::simulator
