// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/observe.h"

#include <algorithm>
#include <cmath>

#include "ingest/agents/detections/depth_cue.h"
#include "ingest/agents/detections/floor_cue.h"
#include "ingest/agents/detections/perspective.h"
#include "ingest/agents/detections/torso_axes.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

void SetTorso(const PersonInCamera& person, const Pose3d& map_T_camera, double forward_min,
              PersonObservation* observation) {
  const Pose3d map_T_torso = map_T_camera * person.camera_T_torso;
  const Eigen::Vector3d forward = map_T_torso.orientation * Eigen::Vector3d::UnitX();
  observation->has_heading = person.has_heading && forward.head<2>().norm() >= forward_min;
  observation->heading_sigma_rad =
      observation->has_heading ? person.heading_sigma_rad : kNoHeadingSigmaRad;
  observation->map_T_torso.position = map_T_torso.position;
  if (observation->has_heading) {
    observation->map_T_torso.orientation = Eigen::Quaterniond(
        Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ()));
  }
  const Eigen::Matrix3d map_R_camera = map_T_camera.orientation.toRotationMatrix();
  observation->position_covariance_map =
      map_R_camera * person.covariance_camera * map_R_camera.transpose();
  observation->camera_map = map_T_camera.position;
}

void SetBody(const HumanDetection& detection, const Eigen::Quaterniond& torso_R_root,
             PersonObservation* observation) {
  observation->pose_coefficients = detection.pose_coefficients;
  observation->shape_coefficients = detection.shape_coefficients;
  observation->has_joints = detection.has_joints;
  if (detection.has_joints) {
    observation->joint_visibility = detection.joint_visibility;
    for (size_t j = 0; j < size_t{kJointCount}; ++j) {
      observation->joints_torso[j] = torso_R_root * detection.joints_root[j];
    }
  }
  const std::vector<float>& vertices = detection.vertices_root;
  const Eigen::Matrix3f turn = torso_R_root.toRotationMatrix().cast<float>();
  observation->vertices_torso.reserve(vertices.size());
  for (size_t i = 0; i + 2 < vertices.size(); i += 3) {
    const Eigen::Vector3f vertex =
        turn * Eigen::Vector3f(vertices[i], vertices[i + 1], vertices[i + 2]);
    observation->vertices_torso.insert(observation->vertices_torso.end(),
                                       {vertex.x(), vertex.y(), vertex.z()});
  }
}

void AddCues(const HumanDetection& detection, const ObservationContext& context,
             const CueOptions& options, PersonObservation* observation) {
  PlacedBody body;
  body.joints_map.fill(Eigen::Vector3d::Zero());
  body.detection = &detection;
  body.camera = context.camera;
  body.map_T_camera = context.map_T_camera;
  body.torso_map = observation->map_T_torso.position;
  body.visibility = MeanVisibility(detection);
  body.floor_options = options.floor;
  body.depth_options = options.depth;
  if (detection.has_joints) {
    for (size_t j = 0; j < size_t{kJointCount}; ++j) {
      body.joints_map[j] = observation->map_T_torso.orientation * observation->joints_torso[j];
    }
  }
  if (options.is_floor_used && context.floor_z_map.has_value()) {
    auto cue = FloorContactCue(body, *context.floor_z_map);
    if (!cue.has_value()) cue = HeadTopCue(body, *context.floor_z_map);
    if (cue.has_value()) observation->cues.push_back(*cue);
  }
  if (options.is_depth_used && context.depth != nullptr) {
    if (const auto cue = DepthImageCue(body, *context.depth)) observation->cues.push_back(*cue);
  }
  if (options.is_height_used && context.floor_z_map.has_value()) {
    observation->cues.push_back(TorsoHeightCue(body, *context.floor_z_map,
                                               options.floor.torso_height_m,
                                               options.floor.torso_height_sigma_m));
  }
}

}  // namespace

absl::StatusOr<PersonObservation> Observe(const HumanDetection& detection,
                                          const ObservationContext& context,
                                          const CueOptions& options) {
  DSG_CHECK(context.camera != nullptr);
  DSG_ASSIGN_OR_RETURN(const PersonInCamera person,
                       PlaceInCamera(detection, *context.camera, options.placement));
  PersonObservation observation;
  observation.joints_torso.fill(Eigen::Vector3d::Zero());
  observation.time_ns = detection.time_ns;
  observation.detection_id = detection.id;
  SetTorso(person, context.map_T_camera, options.placement.forward_min, &observation);
  const Eigen::Quaterniond torso_R_root = observation.map_T_torso.orientation.conjugate() *
                                          context.map_T_camera.orientation * person.joints_turn;
  SetBody(detection, torso_R_root, &observation);
  AddCues(detection, context, options, &observation);
  return observation;
}

}  // namespace dsg::ingest
