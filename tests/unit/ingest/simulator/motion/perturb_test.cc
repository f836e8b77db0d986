// SPDX-License-Identifier: Apache-2.0
// The rig is the one of uHumans2, and a perturbed calibration is wrong by as much as asked for.
#include "ingest/simulator/motion/perturb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

using ingest::CameraCalibration;
using ingest::RigCalibration;

TEST(ReferenceRig, IsValidAndInOrder) {
  const RigCalibration rig = ReferenceRig();
  ASSERT_EQ(rig.cameras.size(), 5u);
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    EXPECT_TRUE(rig.cameras[i].Validate().ok());
    EXPECT_TRUE(i == 0 || rig.cameras[i - 1].name < rig.cameras[i].name);
  }
  ASSERT_TRUE(rig.imu.has_value());
  EXPECT_TRUE(rig.imu->Validate().ok());
  EXPECT_EQ(rig.imu->rate_hz, 200.0);
  EXPECT_EQ(rig.imu->gyro_noise_density, 1.6968e-4);
  EXPECT_EQ(rig.imu->accel_random_walk, 3.0e-3);
}

TEST(ReferenceRig, FramePeriodsAreWholeNanoseconds) {
  for (const CameraCalibration& camera : ReferenceRig().cameras) {
    const double period_ns = 1e9 / camera.rate_hz;
    EXPECT_EQ(period_ns, std::round(period_ns)) << camera.name;
    EXPECT_EQ(camera.rate_hz, camera.name.starts_with("cam") ? 20.0 : 5.0) << camera.name;
  }
}

TEST(ReferenceRig, LooksAheadWithTheLeftCameraOnTheLeft) {
  const RigCalibration rig = ReferenceRig();
  const Pose3d& left = rig.FindCamera("cam0")->body_T_camera;
  const Pose3d& right = rig.FindCamera("cam1")->body_T_camera;
  EXPECT_LT((left * Eigen::Vector3d(0, 0, 2) - Eigen::Vector3d(2, 0.05, 0)).norm(), 1e-12);
  EXPECT_LT((left * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, -0.95, 0)).norm(), 1e-12);
  EXPECT_LT((left * Eigen::Vector3d(0, 1, 0) - Eigen::Vector3d(0, 0.05, -1)).norm(), 1e-12);
  // The right camera lies on the left one's x axis, 0.1 m along.
  EXPECT_LT(((left.Inverse() * right).position - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-12);
}

TEST(PerturbRig, KeepsEverythingWithoutErrors) {
  const RigCalibration truth = ReferenceRig();
  const PerturbedRig rig = PerturbRig(truth, {0.0, 0.0, 0.0, 0.0}, 7);
  EXPECT_EQ(rig.camera_time_offset_ns, 0);
  for (size_t i = 0; i < truth.cameras.size(); ++i) {
    EXPECT_EQ(rig.told.cameras[i].fx, truth.cameras[i].fx);
    EXPECT_EQ(rig.told.cameras[i].body_T_camera.orientation.coeffs(),
              truth.cameras[i].body_T_camera.orientation.coeffs());
  }
}

TEST(PerturbRig, KeepsNamesAndSizesAndWhatSharesCam0sPlace) {
  const RigCalibration truth = ReferenceRig();
  const PerturbedRig rig = PerturbRig(truth, {}, 7);
  const CameraCalibration& left = *rig.told.FindCamera("cam0");
  for (size_t i = 0; i < truth.cameras.size(); ++i) {
    const CameraCalibration& camera = rig.told.cameras[i];
    EXPECT_TRUE(camera.Validate().ok());
    EXPECT_EQ(camera.name, truth.cameras[i].name);
    EXPECT_EQ(camera.width, truth.cameras[i].width);
    EXPECT_EQ(camera.rate_hz, truth.cameras[i].rate_hz);
    const bool same = camera.fx == left.fx && camera.cy == left.cy &&
                      camera.body_T_camera.position == left.body_T_camera.position;
    EXPECT_EQ(same, camera.name != "cam1") << camera.name;
  }
}

TEST(PerturbRig, SameSeedSameRig) {
  const PerturbedRig a = PerturbRig(ReferenceRig(), {}, 11);
  const PerturbedRig b = PerturbRig(ReferenceRig(), {}, 11);
  const PerturbedRig c = PerturbRig(ReferenceRig(), {}, 12);
  EXPECT_EQ(a.camera_time_offset_ns, b.camera_time_offset_ns);
  EXPECT_EQ(a.told.cameras[1].fx, b.told.cameras[1].fx);
  EXPECT_NE(a.camera_time_offset_ns, c.camera_time_offset_ns);
  EXPECT_NE(a.told.cameras[1].fx, c.told.cameras[1].fx);
}

TEST(PerturbRig, IsWrongByAsMuchAsAskedFor) {
  const RigCalibration truth = ReferenceRig();
  const int count = 2000;
  double focal = 0.0;
  double center = 0.0;
  double turn = 0.0;
  double shift = 0.0;
  double offset = 0.0;
  for (int seed = 0; seed < count; ++seed) {
    const PerturbedRig rig = PerturbRig(truth, {}, static_cast<uint64_t>(seed));
    const CameraCalibration& told = *rig.told.FindCamera("cam1");
    const CameraCalibration& real = *truth.FindCamera("cam1");
    const double angle =
        AngleBetween(told.body_T_camera.orientation, real.body_T_camera.orientation);
    EXPECT_LT(angle, 3.0 * 0.1 * std::numbers::pi / 180.0 + 1e-9);
    focal += std::pow(told.fx - real.fx, 2) / count;
    center += std::pow(told.cy - real.cy, 2) / count;
    turn += angle * angle / count;
    shift += (told.body_T_camera.position - real.body_T_camera.position).squaredNorm() / count;
    offset += std::pow(1e-9 * static_cast<double>(rig.camera_time_offset_ns), 2) / count;
  }
  EXPECT_NEAR(std::sqrt(focal), 0.3, 0.02);
  EXPECT_NEAR(std::sqrt(center), 0.3, 0.02);
  EXPECT_NEAR(std::sqrt(turn) * 180.0 / std::numbers::pi, 0.1, 0.005);
  EXPECT_NEAR(std::sqrt(shift), 0.002, 0.0001);
  EXPECT_NEAR(std::sqrt(offset), 0.001, 0.00006);
}

}  // namespace
}  // namespace dsg::simulator
