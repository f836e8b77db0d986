// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/visual_odometry.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <vector>

#include "ingest/odometry/estimator/stereo_eye.h"
#include "tests/unit/ingest/odometry/estimator/textured_room.h"

namespace dsg::ingest {
namespace {

const TexturedRoom& PaintedRoom() {
  static const TexturedRoom* const room = new TexturedRoom();
  return *room;
}

struct Walk {
  double seconds = 6.0;
  double frame_s = 0.05;
  // In motion from the first image on.
  Carried carried{-3.0};
  bool has_depth = true;
  // How much later depth is measured, and whether the odometry knows.
  double late_s = 0.0;
  bool is_late_known = true;
  std::function<bool(double)> is_covered = [](double) { return false; };
  OdometryOptions options;
};

struct WalkOutcome {
  std::vector<OdometryPose> poses;
  OdometryCounts counts;
  int frame_count = 0;
};

std::unique_ptr<OdometryEye> EyeOf(const RoomRig& rig, bool has_depth) {
  const StereoMatchOptions options;
  CameraCalibration depth = rig.left;
  depth.name = "depth0";
  auto eye = has_depth ? MakeDepthEye(rig.left, depth, options)
                       : MakeStereoEye(rig.left, rig.right(), options);
  EXPECT_TRUE(eye.ok()) << eye.status();
  return *std::move(eye);
}

WalkOutcome RunWalk(const Walk& walk) {
  const RoomRig rig;
  const std::unique_ptr<OdometryEye> eye = EyeOf(rig, walk.has_depth);
  auto odometry = VisualOdometry::Make(eye->camera(), walk.options);
  EXPECT_TRUE(odometry.ok()) << odometry.status();
  WalkOutcome outcome;
  for (double t = 0.0; t <= walk.seconds; t += walk.frame_s) {
    const Pose3d map_T_body = walk.carried.At(t);
    const auto seen = [&](const CameraCalibration& camera) {
      if (walk.is_covered(t)) {
        return PaintedImage(camera.width, camera.height, [](int, int) { return 12.0; });
      }
      return PaintedRoom().Seen(camera, map_T_body * camera.body_T_camera);
    };
    const ImageLoad load_other = [&]() -> absl::StatusOr<Image> {
      if (!walk.has_depth) return seen(rig.right());
      return PaintedRoom().Depth(rig.left,
                                 walk.carried.At(t + walk.late_s) * rig.left.body_T_camera);
    };
    auto frame = eye->FrameOf(std::llround(1e9 * t), seen(rig.left), load_other, {});
    EXPECT_TRUE(frame.ok()) << frame.status();
    if (walk.is_late_known) frame->depth_late_ns = std::llround(1e9 * walk.late_s);
    auto poses = odometry->AddFrame(*frame);
    EXPECT_TRUE(poses.ok()) << poses.status();
    outcome.poses.insert(outcome.poses.end(), poses->begin(), poses->end());
    ++outcome.frame_count;
  }
  outcome.counts = odometry->counts();
  return outcome;
}

Pose3d TruthAt(const Walk& walk, const OdometryPose& pose) {
  return walk.carried.At(1e-9 * static_cast<double>(pose.time_ns));
}

// Of positions, moved so that the first poses agree: the whole drift counts.
std::vector<double> DriftsM(const Walk& walk, const std::vector<OdometryPose>& poses) {
  const Pose3d truth_T_odom = TruthAt(walk, poses.front()) * poses.front().map_T_body.Inverse();
  std::vector<double> drifts;
  for (const OdometryPose& pose : poses) {
    drifts.push_back(
        ((truth_T_odom * pose.map_T_body).position - TruthAt(walk, pose).position).norm());
  }
  return drifts;
}

double LargestOf(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

TEST(VisualOdometry, FollowsADepthCamera) {
  const Walk walk;
  const WalkOutcome outcome = RunWalk(walk);
  ASSERT_EQ(outcome.poses.size(), static_cast<size_t>(outcome.frame_count));
  EXPECT_EQ(outcome.counts.starts_by_images, 1);
  EXPECT_EQ(outcome.counts.unplaced, 0);
  EXPECT_TRUE(outcome.counts.losses.empty());
  const double drift_m = LargestOf(DriftsM(walk, outcome.poses));
  const double turn = AngleBetween(outcome.poses.front().map_T_body.orientation.conjugate() *
                                       outcome.poses.back().map_T_body.orientation,
                                   TruthAt(walk, outcome.poses.front()).orientation.conjugate() *
                                       TruthAt(walk, outcome.poses.back()).orientation);
  std::cout << "depth: largest drift " << drift_m << " m, turned wrongly by " << turn << " rad, "
            << outcome.counts.keyframes << " keyframes\n";
  EXPECT_LT(drift_m, 0.03);
  EXPECT_LT(turn, 0.01);
  EXPECT_GT(outcome.counts.keyframes, 5);
}

TEST(VisualOdometry, FollowsAPairOfCameras) {
  Walk walk;
  walk.has_depth = false;
  const WalkOutcome outcome = RunWalk(walk);
  ASSERT_EQ(outcome.poses.size(), static_cast<size_t>(outcome.frame_count));
  const double drift_m = LargestOf(DriftsM(walk, outcome.poses));
  std::cout << "pair: largest drift " << drift_m << " m\n";
  EXPECT_LT(drift_m, 0.08);
}

// 40 ms late, or early, when the camera has turned by a degree.
TEST(VisualOdometry, ReadsDepthWhereTheCameraLookedByThen) {
  for (const double late_s : {0.04, -0.04}) {
    Walk walk;
    walk.late_s = late_s;
    const WalkOutcome known = RunWalk(walk);
    walk.is_late_known = false;
    const WalkOutcome unknown = RunWalk(walk);
    const double known_m = LargestOf(DriftsM(walk, known.poses));
    const double unknown_m = LargestOf(DriftsM(walk, unknown.poses));
    std::cout << "depth " << late_s << " s late: largest drift " << known_m
              << " m, unless that is known " << unknown_m << " m\n";
    EXPECT_LT(known_m, 0.04);
    EXPECT_LT(known_m, unknown_m);
  }
}

TEST(VisualOdometry, BeginsAtTheOriginWithALevelCamera) {
  Walk walk;
  walk.seconds = 0.2;
  const WalkOutcome outcome = RunWalk(walk);
  ASSERT_FALSE(outcome.poses.empty());
  const Pose3d& first = outcome.poses.front().map_T_body;
  EXPECT_EQ(first.position.norm(), 0.0);
  const Pose3d body_T_camera = RoomRig().left.body_T_camera;
  const Eigen::Quaterniond map_R_camera = first.orientation * body_T_camera.orientation;
  EXPECT_LT((map_R_camera * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_LT((map_R_camera * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
}

TEST(VisualOdometry, BeginsAtAGivenAttitude) {
  const RoomRig rig;
  const std::unique_ptr<OdometryEye> eye = EyeOf(rig, /*has_depth=*/true);
  auto odometry = VisualOdometry::Make(eye->camera(), {});
  ASSERT_TRUE(odometry.ok());
  const Eigen::Quaterniond attitude = RotationOf({0.3, -0.2, 0.1});
  odometry->StartAt(attitude);
  const ImageLoad depth = [&]() -> absl::StatusOr<Image> {
    return PaintedRoom().Depth(rig.left, rig.left.body_T_camera);
  };
  const auto frame =
      eye->FrameOf(1, PaintedRoom().Seen(rig.left, rig.left.body_T_camera), depth, {});
  ASSERT_TRUE(frame.ok());
  const auto poses = odometry->AddFrame(*frame);
  ASSERT_TRUE(poses.ok() && poses->size() == 1);
  EXPECT_LT(AngleBetween(poses->front().map_T_body.orientation, attitude), 1e-9);
}

// Errors are what the covariance says, which is told ten times as large.
TEST(VisualOdometry, KnowsHowSureItIs) {
  Walk walk;
  const WalkOutcome outcome = RunWalk(walk);
  const Pose3d truth_T_odom =
      TruthAt(walk, outcome.poses.front()) * outcome.poses.front().map_T_body.Inverse();
  double sum = 0.0;
  for (const OdometryPose& pose : outcome.poses) {
    const Vector6d error =
        StepBetween(truth_T_odom.Inverse() * TruthAt(walk, pose), pose.map_T_body);
    sum += error.dot(pose.covariance.inverse() * error) / 6.0;
  }
  const double mean = sum / static_cast<double>(outcome.poses.size());
  std::cout << "depth: squared errors in units of the covariance " << mean << "\n";
  EXPECT_LT(mean, 1.5);
  EXPECT_GT(mean, 0.001);
  EXPECT_GT(outcome.poses.back().covariance(0, 0), outcome.poses.front().covariance(0, 0));
}

TEST(VisualOdometry, GoesOnWhereItWasAfterAHandBeforeTheLens) {
  Walk walk;
  // It sets in while nothing is seen, and has gone on by 3 cm by then.
  walk.carried.rest_s = 1.2;
  walk.is_covered = [](double t) { return t > 1.01 && t < 1.47; };
  const WalkOutcome outcome = RunWalk(walk);
  EXPECT_TRUE(outcome.counts.losses.empty());
  EXPECT_EQ(outcome.counts.starts_by_images, 1);
  EXPECT_EQ(outcome.counts.unplaced, 9);
  EXPECT_LT(LargestOf(DriftsM(walk, outcome.poses)), 0.05);
}

// Features that are followed to where they are not tell no pose.
TEST(VisualOdometry, DoesNotBelieveWhatItFindsAfterALongWayBehindAHand) {
  Walk walk;
  walk.carried.rest_s = 0.0;
  walk.is_covered = [](double t) { return t > 1.01 && t < 1.32; };
  const WalkOutcome outcome = RunWalk(walk);
  const auto next = std::find_if(outcome.poses.begin(), outcome.poses.end(),
                                 [](const OdometryPose& p) { return p.time_ns > 1'100'000'000; });
  ASSERT_TRUE(next != outcome.poses.end());
  // Lost or not, its error is within what it says.
  const Pose3d truth_T_odom =
      TruthAt(walk, outcome.poses.front()) * outcome.poses.front().map_T_body.Inverse();
  const Vector6d error =
      StepBetween(truth_T_odom.Inverse() * TruthAt(walk, *next), next->map_T_body);
  EXPECT_LT(error.dot(next->covariance.inverse() * error), 12.6);
}

TEST(VisualOdometry, StartsAnewAfterLongBlindnessAndSaysHowLittleItKnows) {
  Walk walk;
  walk.seconds = 7.0;
  walk.is_covered = [](double t) { return t > 2.0 && t < 4.9; };
  const WalkOutcome outcome = RunWalk(walk);
  EXPECT_EQ(outcome.counts.losses.at("blind"), 1);
  EXPECT_EQ(outcome.counts.starts_by_images, 2);
  // The first pose after the gap is the last one before it.
  const auto next = std::find_if(outcome.poses.begin(), outcome.poses.end(),
                                 [](const OdometryPose& p) { return p.time_ns > 2'500'000'000; });
  ASSERT_TRUE(next != outcome.poses.end() && next != outcome.poses.begin());
  EXPECT_GE(next->time_ns, 4'899'000'000);
  EXPECT_LE(next->time_ns, 4'951'000'000);
  const OdometryPose& before = *(next - 1);
  EXPECT_LE(before.time_ns, 2'000'000'001);
  EXPECT_EQ(StepBetween(before.map_T_body, next->map_T_body).norm(), 0.0);
  // 2.9 s at 1 m/s and 1 rad/s.
  EXPECT_GT(next->covariance(0, 0), 8.0);
  EXPECT_GT(next->covariance(5, 5), 8.0);
  EXPECT_LT(before.covariance(0, 0), 0.01);
  // From there on it follows as before.
  EXPECT_LT(LargestOf(DriftsM(walk, {next, outcome.poses.end()})), 0.03);
}

TEST(VisualOdometry, TellsNothingOfWallsWithoutAnythingOnThem) {
  Walk walk;
  walk.seconds = 1.0;
  walk.is_covered = [](double) { return true; };
  const WalkOutcome outcome = RunWalk(walk);
  EXPECT_TRUE(outcome.poses.empty());
  EXPECT_EQ(outcome.counts.unplaced, outcome.frame_count);
  EXPECT_EQ(outcome.counts.starts_by_images, 0);
  EXPECT_TRUE(outcome.counts.losses.empty());
}

TEST(VisualOdometry, GivesTheSamePosesTwice) {
  Walk walk;
  walk.seconds = 3.0;
  const WalkOutcome a = RunWalk(walk);
  const WalkOutcome b = RunWalk(walk);
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(StepBetween(a.poses[i].map_T_body, b.poses[i].map_T_body).norm(), 0.0);
    EXPECT_EQ(a.poses[i].covariance, b.poses[i].covariance);
  }
}

TEST(VisualOdometry, RefusesImagesOutOfOrderAndOfOtherSizes) {
  const RoomRig rig;
  auto odometry = VisualOdometry::Make({rig.left, rig.baseline_m}, {});
  ASSERT_TRUE(odometry.ok());
  OdometryFrame frame;
  frame.time_ns = 100;
  frame.left = PaintedImage(10, 10, [](int, int) { return 0.0; });
  EXPECT_EQ(odometry->AddFrame(frame).status().code(), absl::StatusCode::kInvalidArgument);
  frame.left = PaintedImage(rig.left.width, rig.left.height, [](int, int) { return 0.0; });
  frame.disparities = [](const Image&, std::span<const Eigen::Vector2d> pixels) {
    return std::vector<std::optional<double>>(pixels.size());
  };
  EXPECT_TRUE(odometry->AddFrame(frame).ok());
  frame.time_ns = 50;
  EXPECT_EQ(odometry->AddFrame(frame).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(odometry->AddSample({1, {0, 0, 0}, {0, 0, 9.81}}));
  EXPECT_TRUE(odometry->Covers(1000));
}

}  // namespace
}  // namespace dsg::ingest
