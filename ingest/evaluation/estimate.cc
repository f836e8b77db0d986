// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/estimate.h"

namespace dsg::evaluation {
namespace {

void MovePoses(const Pose3d& new_T_map, std::vector<StampedPose>* poses) {
  for (StampedPose& pose : *poses) pose.map_T_body = new_T_map * pose.map_T_body;
}

void MoveTorsos(const Pose3d& new_T_map, std::vector<TrackedTorso>* torsos) {
  for (TrackedTorso& torso : *torsos) torso.torso_map = new_T_map * torso.torso_map;
}

Box3d MovedBox(const Pose3d& new_T_map, const Box3d& box) {
  Box3d moved;
  if (box.isEmpty()) return moved;
  for (int corner = 0; corner < 8; ++corner) {
    moved.extend(new_T_map * box.corner(static_cast<Box3d::CornerType>(corner)));
  }
  return moved;
}

}  // namespace

void MoveEstimate(const Pose3d& new_T_map, Estimate* estimate) {
  MovePoses(new_T_map, &estimate->robot_causal);
  MovePoses(new_T_map, &estimate->robot);
  const Eigen::Matrix3f turn = new_T_map.orientation.toRotationMatrix().cast<float>();
  for (Eigen::Vector3f& position : estimate->mesh.positions_map) {
    position = (new_T_map * position.cast<double>().eval()).cast<float>();
  }
  for (Eigen::Vector3f& normal : estimate->mesh.normals_map) normal = turn * normal;
  MoveTorsos(new_T_map, &estimate->torsos);
  MoveTorsos(new_T_map, &estimate->detection_priors);
  for (TrackedBody& body : estimate->bodies) body.map_T_torso = new_T_map * body.map_T_torso;
  for (EstimatedObject& object : estimate->objects) {
    object.position_map = new_T_map * object.position_map;
    object.box_map = MovedBox(new_T_map, object.box_map);
    if (object.map_T_model.has_value()) object.map_T_model = new_T_map * *object.map_T_model;
  }
  for (EstimatedPlace& place : estimate->places) {
    place.position_map = new_T_map * place.position_map;
  }
}

}  // namespace dsg::evaluation
