// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ingest/evaluation/evaluate.h"

namespace dsg::evaluation {
namespace {

// A quarter turn to the left, and then by a metre each.
Pose3d QuarterTurn() {
  return {{1.0, 1.0, 1.0}, Eigen::Quaterniond(std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5))};
}

Estimate Small() {
  Estimate estimate;
  for (int i = 0; i < 4; ++i) {
    estimate.robot_causal.push_back({i * kNsPerSecond, {{1.0 * i, 0.1 * i * i, 0.0}, {}}, nullptr});
  }
  estimate.robot = estimate.robot_causal;
  for (StampedPose& pose : estimate.robot_causal) pose.map_T_body.orientation.setIdentity();
  for (StampedPose& pose : estimate.robot) pose.map_T_body.orientation.setIdentity();
  estimate.mesh.positions_map = {{2.0f, 0.0f, 0.0f}};
  estimate.mesh.normals_map = {{1.0f, 0.0f, 0.0f}};
  estimate.torsos = {{0, 0, {2.0, 0.0, 1.0}}};
  estimate.detection_priors = {{0, 0, {3.0, 0.0, 1.0}}};
  EstimatedObject object;
  object.position_map = {2.0, 1.0, 0.5};
  object.box_map = Box3d(Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(3.0, 2.0, 1.0));
  object.map_T_model = Pose3d{{2.0, 1.0, 0.0}, Eigen::Quaterniond::Identity()};
  estimate.objects = {object};
  estimate.places = {{{4.0, 0.0, 1.0}, 0.5}};
  return estimate;
}

TEST(MoveEstimate, MovesAllThatLiesInTheMap) {
  Estimate estimate = Small();
  MoveEstimate(QuarterTurn(), &estimate);
  constexpr double kNear = 1e-6;
  EXPECT_LT((estimate.robot[1].map_T_body.position - Eigen::Vector3d(0.9, 2.0, 1.0)).norm(), kNear);
  EXPECT_LT((estimate.robot_causal[1].map_T_body.position - Eigen::Vector3d(0.9, 2.0, 1.0)).norm(),
            kNear);
  EXPECT_LT((estimate.mesh.positions_map[0] - Eigen::Vector3f(1.0f, 3.0f, 1.0f)).norm(), 1e-5f);
  EXPECT_LT((estimate.mesh.normals_map[0] - Eigen::Vector3f(0.0f, 1.0f, 0.0f)).norm(), 1e-5f);
  EXPECT_LT((estimate.torsos[0].torso_map - Eigen::Vector3d(1.0, 3.0, 2.0)).norm(), kNear);
  EXPECT_LT((estimate.detection_priors[0].torso_map - Eigen::Vector3d(1.0, 4.0, 2.0)).norm(),
            kNear);
  const EstimatedObject& object = estimate.objects[0];
  EXPECT_LT((object.position_map - Eigen::Vector3d(0.0, 3.0, 1.5)).norm(), kNear);
  EXPECT_LT((object.box_map.min() - Eigen::Vector3d(-1.0, 2.0, 1.0)).norm(), kNear);
  EXPECT_LT((object.box_map.max() - Eigen::Vector3d(1.0, 4.0, 2.0)).norm(), kNear);
  EXPECT_LT((object.map_T_model->position - Eigen::Vector3d(0.0, 3.0, 1.0)).norm(), kNear);
  EXPECT_LT((estimate.places[0].position_map - Eigen::Vector3d(1.0, 5.0, 2.0)).norm(), kNear);
}

TEST(AlignMap, BringsThePathOntoTheTrueOne) {
  Estimate estimate = Small();
  truth::Truth truth;
  for (const StampedPose& pose : estimate.robot_causal) {
    truth::RobotState state;
    state.time_ns = pose.time_ns;
    state.map_T_body = QuarterTurn() * pose.map_T_body;
    truth.robot.push_back(state);
  }
  // The truth of a gap of more than a tenth of a second is not known: at its own stamps it is.
  ASSERT_TRUE(AlignMap(truth, &estimate).ok());
  for (size_t i = 0; i < truth.robot.size(); ++i) {
    EXPECT_LT((estimate.robot[i].map_T_body.position - truth.robot[i].map_T_body.position).norm(),
              1e-6);
  }
  EXPECT_EQ(estimate.notes.size(), 1u);
}

TEST(AlignMap, RefusesTheTruthOfAnotherLog) {
  Estimate estimate = Small();
  EXPECT_EQ(AlignMap(truth::Truth(), &estimate).code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace dsg::evaluation
