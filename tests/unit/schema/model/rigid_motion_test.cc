// SPDX-License-Identifier: Apache-2.0
#include "schema/model/rigid_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

namespace dsg {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

Pose3d Turn(double yaw_rad, const Eigen::Vector3d& shift) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()))};
}

Pose3d Tilt(double angle_rad, const Eigen::Vector3d& shift) {
  return {shift, Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()))};
}

// An error of a pose as Covariance6 has it: translation in the map, rotation vector of the agent.
Pose3d WithError(const Pose3d& pose, const Vector6& error) {
  const Eigen::Vector3d rotation = error.tail<3>();
  const Eigen::AngleAxisd turn(rotation.norm(), rotation.normalized());
  return {pose.position + error.head<3>(), pose.orientation * turn};
}

Vector6 ErrorOf(const Pose3d& pose, const Pose3d& estimate) {
  const Eigen::AngleAxisd turn(pose.orientation.conjugate() * estimate.orientation);
  Vector6 error;
  error << estimate.position - pose.position, turn.angle() * turn.axis();
  return error;
}

Covariance6 OuterProduct(const Vector6& error) {
  Covariance6 upper{};
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      upper[next++] = static_cast<float>(error[row] * error[column]);
    }
  }
  return upper;
}

// Not a rule that is written down twice: the covariance of one error is its outer product, and the
// error of a moved pose follows from the poses alone.
TEST(TransformPose, GivesTheCovarianceThatErrorsOfMovedPosesHave) {
  const Pose3d pose{{3.0, -2.0, 1.0}, Eigen::Quaterniond(0.4, -0.2, 0.7, 0.3).normalized()};
  Vector6 error;
  error << 0.3, -0.1, 0.2, 0.05, -0.02, 0.04;
  const Pose3d new_T_old{{-1.0, 4.0, 0.5}, Eigen::Quaterniond(0.8, 0.03, -0.02, 0.6).normalized()};
  TimedPose moved;
  moved.map_T_agent = pose;
  moved.covariance = std::make_shared<const Covariance6>(OuterProduct(error));
  TransformPose(new_T_old, &moved);
  const Covariance6 expected =
      OuterProduct(ErrorOf(new_T_old * pose, new_T_old * WithError(pose, error)));
  for (size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR((*moved.covariance)[i], expected[i], 1e-6f);
}

TEST(TransformPose, KeepsRollAndPitchOfTheAgentApartInATurnedMap) {
  Covariance6 covariance{};
  covariance[0] = 4.0f;   // x
  covariance[6] = 1.0f;   // y
  covariance[15] = 9.0f;  // roll
  covariance[18] = 0.5f;  // pitch
  TimedPose pose;
  pose.covariance = std::make_shared<const Covariance6>(covariance);
  TransformPose(Turn(std::numbers::pi / 2.0, {1.0, 0.0, 2.0}), &pose);
  EXPECT_NEAR((*pose.covariance)[0], 1.0f, 1e-6f);
  EXPECT_NEAR((*pose.covariance)[6], 4.0f, 1e-6f);
  EXPECT_EQ((*pose.covariance)[15], 9.0f);
  EXPECT_EQ((*pose.covariance)[18], 0.5f);
}

TEST(TransformPose, LeavesPosesWithoutOrientationWithoutOne) {
  TimedPose pose;
  pose.flags = pose_flags::kNoOrientation;
  pose.map_T_agent.position = {2.0, 0.0, 0.0};
  TransformPose(Turn(1.0, {1.0, 0.0, 2.0}), &pose);
  EXPECT_EQ(pose.map_T_agent.orientation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_NEAR(pose.map_T_agent.position.x(), 1.0 + 2.0 * std::cos(1.0), 1e-12);
}

TEST(TransformNode, MovesPlanesAndModels) {
  const Pose3d turn = Turn(std::numbers::pi / 2.0, {1.0, 0.0, 2.0});
  Node wall;
  wall.structure = StructureInfo{"wall", Eigen::Vector3d::UnitX(), -3.0, 0};
  TransformNode(turn, &wall);
  const Eigen::Vector3d on_wall = turn * Eigen::Vector3d(3.0, 7.0, 1.0);
  EXPECT_NEAR(wall.structure->plane_normal_map.dot(on_wall) + wall.structure->plane_offset_m, 0.0,
              1e-12);
  Node chair;
  chair.object.emplace();
  chair.object->model = Sha256{1};
  chair.object->map_T_model.position = {1.0, 0.0, 0.0};
  TransformNode(turn, &chair);
  EXPECT_LT((chair.object->map_T_model.position - Eigen::Vector3d(1.0, 1.0, 2.0)).norm(), 1e-12);
}

// A floor plan lies in the plane of its node, so a tilt moves it as it moves the node.
TEST(TransformNode, MovesFloorPlansWithTheirNode) {
  for (const Pose3d& motion : {Turn(0.3, {1.0, 2.0, 0.25}), Tilt(0.05, {0.0, 0.0, 1.0})}) {
    Node room;
    room.map_T_node.position = {40.0, 60.0, 3.0};
    room.region.emplace();
    room.region->footprint_map = {{40.0, 60.0}, {44.0, 60.0}, {44.0, 63.0}};
    room.region->z_min_m = 3.0;
    room.region->z_max_m = 5.5;
    const Eigen::Vector3d expected = motion * room.map_T_node.position;
    TransformNode(motion, &room);
    EXPECT_LT((room.map_T_node.position - expected).norm(), 1e-12);
    EXPECT_LT((room.region->footprint_map[0] - expected.head<2>()).norm(), 1e-12);
    EXPECT_NEAR(room.region->z_min_m, expected.z(), 1e-12);
    EXPECT_NEAR(room.region->z_max_m, expected.z() + 2.5, 1e-12);
  }
}

TEST(TransformFactor, MovesPriorsAndLeavesRelativePoses) {
  const Pose3d motion = Turn(std::numbers::pi / 2.0, {1.0, 2.0, 0.0});
  Covariance6 information{};
  information[0] = 1.0f;   // x
  information[6] = 25.0f;  // y
  information[15] = 9.0f;  // roll
  PoseFactor prior;
  prior.from_ns = prior.to_ns = 5;
  prior.information = information;
  TransformFactor(motion, &prior);
  EXPECT_EQ(prior.relative_pose.position, motion.position);
  EXPECT_NEAR((*prior.information)[0], 25.0f, 1e-5f);
  EXPECT_NEAR((*prior.information)[6], 1.0f, 1e-5f);
  EXPECT_EQ((*prior.information)[15], 9.0f);
  PoseFactor step;
  step.to_ns = 5;
  step.information = information;
  TransformFactor(motion, &step);
  EXPECT_EQ(step.relative_pose.position, Eigen::Vector3d::Zero());
  EXPECT_EQ(*step.information, information);
}

TEST(TiltOf, IsTheAngleOfTheVerticals) {
  EXPECT_EQ(TiltOf(Turn(2.0, {1.0, 1.0, 1.0})), 0.0);
  EXPECT_NEAR(TiltOf(Tilt(0.2, {0.0, 0.0, 1.0})), 0.2, 1e-12);
}

}  // namespace
}  // namespace dsg
