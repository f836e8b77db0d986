// SPDX-License-Identifier: Apache-2.0
// An observation in the map holds what the detection said, turned and placed.
#include "ingest/agents/detections/observe.h"

#include <cmath>

#include "tests/unit/ingest/agents/detections/detection_test_util.h"

namespace dsg::ingest {
namespace {

constexpr uint64_t kObserveSeed = 20200515;

class ObserveTest : public testing::Test {
 protected:
  ObserveTest() {
    context_.map_T_camera = Upright({3.0, -2.0, 0.0}, 0.7) * LookAlongX(1.2, 0.15);
    context_.camera = &camera_;
    torso_ = Upright({3.0, -2.0, 0.0}, 0.7) * Upright({5.0, 0.4, 0.93}, 2.0);
    detection_ = PerfectDetection(camera_, context_.map_T_camera, torso_);
    detection_.time_ns = 12345;
  }

  PersonObservation Seen(const CueOptions& options = {}) {
    auto seen = Observe(detection_, context_, options);
    EXPECT_TRUE(seen.ok()) << seen.status();
    return *std::move(seen);
  }

  CameraCalibration camera_ = TestCamera();
  ObservationContext context_;
  Pose3d torso_;
  HumanDetection detection_;
};

TEST_F(ObserveTest, PutsTorsoJointsAndMeshIntoTheMap) {
  const Joints joints = StandingJoints();
  for (const Eigen::Vector3d& joint : detection_.joints_root) {
    for (int axis = 0; axis < 3; ++axis) {
      detection_.vertices_root.push_back(static_cast<float>(joint[axis]));
    }
  }
  detection_.shape_coefficients.assign(10, 0.5f);
  const PersonObservation seen = Seen();
  EXPECT_EQ(seen.time_ns, 12345);
  EXPECT_EQ(seen.detection_id, 7);
  EXPECT_LT((seen.map_T_torso.position - torso_.position).norm(), 1e-6);
  EXPECT_LT(AngleBetween(seen.map_T_torso.orientation, torso_.orientation), 1e-5);
  EXPECT_EQ(seen.camera_map, context_.map_T_camera.position);
  ASSERT_TRUE(seen.has_joints);
  ASSERT_EQ(seen.vertices_torso.size(), 3u * kJointCount);
  for (size_t j = 0; j < joints.size(); ++j) {
    EXPECT_LT((seen.joints_torso[j] - joints[j]).norm(), 1e-5);
    for (size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(seen.vertices_torso[3 * j + axis], joints[j][static_cast<int>(axis)], 1e-5);
    }
  }
  EXPECT_EQ(seen.pose_coefficients, detection_.pose_coefficients);
  EXPECT_EQ(seen.shape_coefficients, detection_.shape_coefficients);
}

TEST_F(ObserveTest, KeepsTheTorsoUprightWhenThePersonBends) {
  Joints bent = StandingJoints();
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  for (auto& joint : bent) joint = tilt * joint;
  detection_ = PerfectDetection(camera_, context_.map_T_camera, torso_, bent);
  detection_.pose_coefficients.clear();
  const PersonObservation seen = Seen();
  EXPECT_LT(AngleBetween(seen.map_T_torso.orientation, torso_.orientation), 1e-4);
  EXPECT_LT((seen.joints_torso[15] - bent[15]).norm(), 1e-4) << "the joints do bend";
}

TEST_F(ObserveTest, GivesNoHeadingToSomebodyLyingDown) {
  Joints lying = StandingJoints();
  const Eigen::Quaterniond fall(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
  for (auto& joint : lying) joint = fall * joint;
  detection_ = PerfectDetection(camera_, context_.map_T_camera, torso_, lying);
  detection_.pose_coefficients.clear();
  const PersonObservation seen = Seen();
  EXPECT_FALSE(seen.has_heading);
  EXPECT_GT(seen.heading_sigma_rad, 1.0);
  EXPECT_TRUE(IsValidPose(seen.map_T_torso));
}

TEST_F(ObserveTest, IsUnsureAlongTheRayInTheMap) {
  const PersonObservation seen = Seen();
  const Eigen::Vector3d ray = (torso_.position - seen.camera_map).normalized();
  const Eigen::Matrix3d& covariance = seen.position_covariance_map;
  EXPECT_GT(ray.dot(covariance * ray), 5.0 * (covariance.trace() - ray.dot(covariance * ray)) / 2);
  EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-12);
}

TEST_F(ObserveTest, AddsTheCuesThatAreAskedForAndPossible) {
  EXPECT_TRUE(Seen().cues.empty()) << "neither floor nor depth is known";
  context_.floor_z_map = 0.0;
  using Kind = PositionCue::Kind;
  const PersonObservation seen = Seen();
  ASSERT_EQ(seen.cues.size(), 2u);
  EXPECT_EQ(seen.cues[0].kind, Kind::kFloorContact);
  EXPECT_EQ(seen.cues[1].kind, Kind::kTorsoHeight);
  EXPECT_TRUE(
      Seen({.is_floor_used = false, .is_depth_used = false, .is_height_used = false}).cues.empty());
  ASSERT_EQ(Seen({.is_floor_used = false}).cues.size(), 1u);
  EXPECT_EQ(Seen({.is_floor_used = false}).cues[0].kind, Kind::kTorsoHeight);
  detection_.joint_visibility[10] = detection_.joint_visibility[11] = 0.0;
  ASSERT_EQ(Seen().cues.size(), 2u) << "the head stands in for the feet";
  EXPECT_LT(Seen().cues[0].information_map.trace(), seen.cues[0].information_map.trace());
}

TEST_F(ObserveTest, LeavesTheDetectionAloneInThePapersMode) {
  context_.floor_z_map = 0.0;
  const PersonObservation with = Seen();
  const PersonObservation without =
      Seen({.is_floor_used = false, .is_depth_used = false, .is_height_used = false});
  EXPECT_EQ(with.map_T_torso.position, without.map_T_torso.position);
  EXPECT_EQ(with.position_covariance_map, without.position_covariance_map);
}

TEST_F(ObserveTest, ObservesABoxWithoutJoints) {
  detection_.has_joints = false;
  detection_.pose_coefficients.clear();
  detection_.weak_scale = 0.0;
  context_.floor_z_map = 0.0;
  const PersonObservation seen = Seen();
  EXPECT_FALSE(seen.has_joints);
  EXPECT_FALSE(seen.has_heading);
  EXPECT_TRUE(seen.joints_torso[3].isZero());
  EXPECT_LT((seen.map_T_torso.position - torso_.position).norm(), 0.4);
  EXPECT_EQ(seen.cues.size(), 2u);
}

TEST_F(ObserveTest, SaysTheSameAgain) {
  SCOPED_TRACE(testing::Message() << "seed " << kObserveSeed);
  Random random(kObserveSeed, 1);
  context_.floor_z_map = 0.0;
  for (auto& pixel : detection_.joints_px) pixel.x() += 3.0 * random.Normal();
  const PersonObservation first = Seen();
  const PersonObservation second = Seen();
  EXPECT_EQ(first.map_T_torso.position, second.map_T_torso.position);
  EXPECT_EQ(first.cues[0].torso_map, second.cues[0].torso_map);
}

}  // namespace
}  // namespace dsg::ingest
