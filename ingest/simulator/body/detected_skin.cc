// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/detected_skin.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/simulator/body/body_skin.h"

namespace dsg::simulator {
namespace {

using JointPoints = std::array<Eigen::Vector3d, ingest::kJointCount>;

/// How much of a joint's error a vertex takes over.
struct JointShare {
  int joint = 0;
  double share = 0.0;
};

// The joints at the ends of the bones that a vertex hangs on: its own, the one before it and the
// ones after it. Head, hands and toes keep their form, so that they never turn inside out.
std::vector<int> JointsAbout(int joint) {
  std::vector<int> joints = {joint};
  const auto& parents = JointParents();
  for (int child = 0; child < ingest::kJointCount; ++child) {
    if (parents[static_cast<size_t>(child)] == joint) joints.push_back(child);
  }
  const int parent = parents[static_cast<size_t>(joint)];
  if (joints.size() > 1 && parent >= 0) joints.push_back(parent);
  return joints;
}

// Inverse distance weighting on the mean body at rest. Source: Shepard, "A two-dimensional
// interpolation function for irregularly-spaced data", 1968.
std::vector<std::vector<JointShare>> MakeShares() {
  constexpr double kNearM = 0.01;
  const BodyModel mean{ShapeCoefficients()};
  const Posture rest;
  const JointPoints joints = mean.Joints(rest);
  TriangleMesh skin;
  mean.Skin(rest, &skin);
  std::vector<std::vector<JointShare>> shares;
  for (size_t i = 0; i < skin.vertices.size(); ++i) {
    std::vector<JointShare> of_vertex;
    double sum = 0.0;
    for (const int joint : JointsAbout(BodyModel::VertexJoints()[i])) {
      const double distance_m =
          (skin.vertices[i].cast<double>() - joints[static_cast<size_t>(joint)]).norm();
      const double weight = 1.0 / std::pow(std::max(distance_m, kNearM), 3);
      of_vertex.push_back({joint, weight});
      sum += weight;
    }
    for (JointShare& share : of_vertex) share.share /= sum;
    shares.push_back(std::move(of_vertex));
  }
  return shares;
}

}  // namespace

SkinPair MakeSkins(const DetectedBody& body, const BodyModel& model,
                   const JointPoints& joints_root) {
  static const std::vector<std::vector<JointShare>> shares = MakeShares();
  const Eigen::Quaterniond camera_R_torso = body.camera_R_map * body.map_T_torso.orientation;
  JointPoints joints = model.Joints(body.posture);
  const Eigen::Vector3d pelvis = joints[ingest::kPelvis];
  JointPoints errors;
  for (size_t j = 0; j < joints.size(); ++j) {
    errors[j] = joints_root[j] - camera_R_torso * (joints[j] - pelvis);
  }
  TriangleMesh skin;
  model.Skin(body.posture, &skin);
  SkinPair out;
  for (size_t i = 0; i < skin.vertices.size(); ++i) {
    const Eigen::Vector3d root_torso = skin.vertices[i].cast<double>() - pelvis;
    out.true_root_map.push_back((body.map_T_torso.orientation * root_torso).cast<float>());
    Eigen::Vector3d detected = camera_R_torso * root_torso;
    for (const JointShare& share : shares[i]) {
      detected += share.share * errors[static_cast<size_t>(share.joint)];
    }
    out.detected_root_camera.push_back(detected.cast<float>());
  }
  return out;
}

double MeanSkinErrorM(const DetectedBody& body, const SkinPair& skins) {
  const Eigen::Matrix3f map_R_camera =
      body.camera_R_map.conjugate().toRotationMatrix().cast<float>();
  double sum_m = 0.0;
  for (size_t i = 0; i < skins.true_root_map.size(); ++i) {
    const Eigen::Vector3f error =
        map_R_camera * skins.detected_root_camera[i] - skins.true_root_map[i];
    sum_m += static_cast<double>(error.norm());
  }
  return sum_m / static_cast<double>(skins.true_root_map.size());
}

}  // namespace dsg::simulator
