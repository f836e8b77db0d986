// SPDX-License-Identifier: Apache-2.0
// The skin of a body as it was and as a detection believes it to be: it errs as the joints do.
// Refuses luck of its own; the errors of the joints are all there is.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "ingest/sensor/human_detection.h"
#include "ingest/simulator/body/body_model.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

/// The true body behind a detection. A whole log's skins would fill gigabytes, so this is kept
/// and the skin made when it is written.
struct DetectedBody {
  /// Of the person, so that BodyModel is made once each; -1 = the mean body.
  int person = -1;
  Posture posture;
  Pose3d map_T_torso;
  Eigen::Quaterniond camera_R_map = Eigen::Quaterniond::Identity();
};

/// Vertices minus the pelvis, metres, in the order of SkinTopologyOfAll.
struct SkinPair {
  /// As it was, axes of the map.
  std::vector<Eigen::Vector3f> true_root_map;
  /// As the detection believes, axes of the camera.
  std::vector<Eigen::Vector3f> detected_root_camera;
};

/// Each vertex is off by the mean of the errors of the joints at both ends of its bones, weighted
/// by nearness, so that the skin stays whole; head, hands and toes by those of their joint.
/// `joints_root`: the detection's. Requires: `model` is that of the body. Cost: below a
/// millisecond.
SkinPair MakeSkins(const DetectedBody& body, const BodyModel& model,
                   const std::array<Eigen::Vector3d, ingest::kJointCount>& joints_root);

/// Mean distance between vertices of both skins, metres.
double MeanSkinErrorM(const DetectedBody& body, const SkinPair& skins);

}  // namespace dsg::simulator
