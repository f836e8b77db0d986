// SPDX-License-Identifier: Apache-2.0
// Calibrations that cannot be are refused by name, and points land on the pixels worked out by
// hand.
#include "ingest/sensor/calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraCalibration GoodCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.rate_hz = 20.0;
  camera.fx = 400.0;
  camera.fy = 410.0;
  camera.cx = 360.0;
  camera.cy = 240.0;
  return camera;
}

ImuCalibration GoodImu() {
  ImuCalibration imu;
  imu.name = "imu0";
  imu.rate_hz = 200.0;
  imu.gyro_noise_density = 1.7e-4;
  imu.gyro_random_walk = 1.9e-5;
  imu.accel_noise_density = 2e-3;
  imu.accel_random_walk = 3e-3;
  return imu;
}

// Refused, by the camera's name and the field's.
void ExpectRefused(const absl::Status& status, const std::string& sensor,
                   const std::string& field) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field;
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << field;
  EXPECT_EQ(MetadataOf(status)["field"], sensor + "." + field);
  EXPECT_NE(std::string(status.message()).find(sensor), std::string::npos) << status;
}

TEST(CameraCalibration, RefusesAViewThatNoPinholeHas) {
  CameraCalibration camera = GoodCamera();
  camera.fx = 0.577;
  ExpectRefused(camera.Validate(), "cam0", "fx");
  camera.fx = 70.0;
  EXPECT_TRUE(camera.Validate().ok());
  camera.fx = 41.0;
  ExpectRefused(camera.Validate(), "cam0", "fx");
  camera.distortion = Distortion::kEquidistant;
  camera.distortion_coefficients = {0.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(camera.Validate().ok()) << "a fisheye looks wider";
}

TEST(CameraCalibration, AcceptsWhatCamerasAre) {
  CameraCalibration camera = GoodCamera();
  EXPECT_TRUE(camera.Validate().ok());
  camera.rate_hz = 0.0;
  EXPECT_TRUE(camera.Validate().ok()) << "0 = unknown";
  camera.cx = -20.0;
  EXPECT_TRUE(camera.Validate().ok()) << "a cut-out may leave the principal point outside";
  camera.distortion = Distortion::kRadialTangential;
  camera.distortion_coefficients = {-0.28, 0.07, 1.9e-4, 1.8e-5};
  EXPECT_TRUE(camera.Validate().ok());
  camera.distortion_coefficients.push_back(0.01);
  EXPECT_TRUE(camera.Validate().ok());
  camera.distortion = Distortion::kEquidistant;
  camera.distortion_coefficients = {0.1, 0.2, 0.3, 0.4};
  EXPECT_TRUE(camera.Validate().ok());
}

TEST(CameraCalibration, RefusesSizesThatNoImageHas) {
  for (const int bad :
       {0, -1, 16385, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    CameraCalibration camera = GoodCamera();
    camera.width = bad;
    ExpectRefused(camera.Validate(), "cam0", "width");
    camera = GoodCamera();
    camera.height = bad;
    ExpectRefused(camera.Validate(), "cam0", "height");
  }
  CameraCalibration camera = GoodCamera();
  camera.width = camera.height = 16384;
  ExpectRefused(camera.Validate(), "cam0", "width * height");
}

TEST(CameraCalibration, RefusesNumbersThatNoLensHas) {
  const std::vector<std::pair<std::string, double CameraCalibration::*>> fields = {
      {"fx", &CameraCalibration::fx},
      {"fy", &CameraCalibration::fy},
      {"cx", &CameraCalibration::cx},
      {"cy", &CameraCalibration::cy},
      {"rate_hz", &CameraCalibration::rate_hz}};
  for (const auto& [name, field] : fields) {
    for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
      CameraCalibration camera = GoodCamera();
      camera.*field = bad;
      ExpectRefused(camera.Validate(), "cam0", name);
    }
  }
  for (const double bad : {0.0, -400.0}) {
    CameraCalibration camera = GoodCamera();
    camera.fx = bad;
    ExpectRefused(camera.Validate(), "cam0", "fx");
    camera = GoodCamera();
    camera.fy = bad;
    ExpectRefused(camera.Validate(), "cam0", "fy");
  }
  for (const auto& [name, field] : fields) {
    for (const double absurd : {1.8e19, -2.1e9}) {
      if (name == "rate_hz" && absurd > 0) continue;
      CameraCalibration camera = GoodCamera();
      camera.*field = absurd;
      ExpectRefused(camera.Validate(), "cam0", name);
    }
  }
}

TEST(CameraCalibration, RefusesTheWrongCountOfDistortionCoefficients) {
  for (const auto& [distortion, most] : {std::pair(Distortion::kRadialTangential, size_t{5}),
                                         std::pair(Distortion::kEquidistant, size_t{4})}) {
    for (const size_t count : {size_t{0}, size_t{3}, most + 1}) {
      CameraCalibration camera = GoodCamera();
      camera.distortion = distortion;
      camera.distortion_coefficients.assign(count, 0.1);
      ExpectRefused(camera.Validate(), "cam0", "count of distortion_coefficients");
    }
  }
  CameraCalibration camera = GoodCamera();
  camera.distortion = Distortion::kEquidistant;
  camera.distortion_coefficients = {0.1, std::nan(""), 0.1, 0.1};
  ExpectRefused(camera.Validate(), "cam0", "distortion_coefficients");
}

TEST(CameraCalibration, RefusesPosesThatAreNone) {
  CameraCalibration camera = GoodCamera();
  camera.body_T_camera.position.y() = std::nan("");
  ExpectRefused(camera.Validate(), "cam0", "body_T_camera");
  camera = GoodCamera();
  camera.body_T_camera.orientation.x() = kInfinity;
  ExpectRefused(camera.Validate(), "cam0", "body_T_camera");
  for (const double w : {0.0, 0.99, 2.0}) {
    camera = GoodCamera();
    camera.body_T_camera.orientation = Eigen::Quaterniond(w, 0, 0, 0);
    ExpectRefused(camera.Validate(), "cam0", "body_T_camera (norm of the rotation)");
  }
}

TEST(ImuCalibration, RefusesNumbersThatNoUnitHas) {
  EXPECT_TRUE(GoodImu().Validate().ok());
  const std::vector<std::pair<std::string, double ImuCalibration::*>> fields = {
      {"rate_hz", &ImuCalibration::rate_hz},
      {"gyroscope_noise_density", &ImuCalibration::gyro_noise_density},
      {"gyroscope_random_walk", &ImuCalibration::gyro_random_walk},
      {"accelerometer_noise_density", &ImuCalibration::accel_noise_density},
      {"accelerometer_random_walk", &ImuCalibration::accel_random_walk}};
  for (const auto& [name, field] : fields) {
    for (const double bad : {std::nan(""), kInfinity, -1.0}) {
      ImuCalibration imu = GoodImu();
      imu.*field = bad;
      ExpectRefused(imu.Validate(), "imu0", name);
    }
  }
  ImuCalibration imu = GoodImu();
  imu.rate_hz = 0.0;
  ExpectRefused(imu.Validate(), "imu0", "rate_hz");
  imu = GoodImu();
  imu.gyro_noise_density = 0.0;
  EXPECT_TRUE(imu.Validate().ok()) << "a unit without noise is a simulated one";
  imu.body_T_imu.orientation.coeffs().setZero();
  ExpectRefused(imu.Validate(), "imu0", "body_T_imu (norm of the rotation)");
}

TEST(RigCalibration, FindsCamerasByName) {
  RigCalibration rig;
  EXPECT_EQ(rig.FindCamera("cam0"), nullptr);
  rig.cameras = {GoodCamera(), GoodCamera()};
  rig.cameras[1].name = "cam1";
  EXPECT_EQ(rig.FindCamera("cam1"), &rig.cameras[1]);
  EXPECT_EQ(rig.FindCamera("cam"), nullptr);
  EXPECT_EQ(rig.FindCamera(""), nullptr);
}

void ExpectPixel(const Eigen::Vector2d& pixel, double x, double y, double tolerance) {
  EXPECT_NEAR(pixel.x(), x, tolerance);
  EXPECT_NEAR(pixel.y(), y, tolerance);
}

TEST(Project, DividesByDepthWithoutDistortion) {
  const CameraCalibration camera = GoodCamera();
  ExpectPixel(Project(camera, {0.0, 0.0, 3.0}), 360.0, 240.0, 1e-12);
  // 400 * 1 / 2 + 360 and 410 * -0.5 / 2 + 240.
  ExpectPixel(Project(camera, {1.0, -0.5, 2.0}), 560.0, 137.5, 1e-12);
}

TEST(Project, BendsByRadialAndTangentialTerms) {
  CameraCalibration camera = GoodCamera();
  camera.distortion = Distortion::kRadialTangential;
  // x = 0.5, y = 0.25: r2 = 0.3125, r4 = 0.09765625, r6 = 0.030517578125.
  const Eigen::Vector3d point(1.0, 0.5, 2.0);
  camera.distortion_coefficients = {-0.2, 0.1, 0.0, 0.0};
  // 1 - 0.0625 + 0.009765625 = 0.947265625.
  ExpectPixel(Project(camera, point), 360.0 + 400.0 * 0.4736328125, 240.0 + 410.0 * 0.23681640625,
              1e-9);
  camera.distortion_coefficients = {0.0, 0.0, 0.01, 0.02};
  // x + 2 p1 x y + p2 (r2 + 2 x^2) = 0.5 + 0.0025 + 0.01625;
  // y + p1 (r2 + 2 y^2) + 2 p2 x y = 0.25 + 0.004375 + 0.005.
  ExpectPixel(Project(camera, point), 360.0 + 400.0 * 0.51875, 240.0 + 410.0 * 0.259375, 1e-9);
  camera.distortion_coefficients = {0.0, 0.0, 0.0, 0.0, 1.0};
  ExpectPixel(Project(camera, point), 360.0 + 400.0 * 0.5 * 1.030517578125,
              240.0 + 410.0 * 0.25 * 1.030517578125, 1e-9);
}

TEST(Project, BendsByAnglesInTheEquidistantModel) {
  CameraCalibration camera = GoodCamera();
  camera.distortion = Distortion::kEquidistant;
  camera.distortion_coefficients = {0.0, 0.0, 0.0, 0.0};
  // 45 degrees to the right: the pixel is at f * pi / 4.
  ExpectPixel(Project(camera, {2.0, 0.0, 2.0}), 360.0 + 400.0 * std::numbers::pi / 4.0, 240.0,
              1e-9);
  camera.distortion_coefficients = {0.1, 0.2, 0.3, 0.4};
  const double t = std::numbers::pi / 4.0;
  const double bent =
      t + 0.1 * std::pow(t, 3) + 0.2 * std::pow(t, 5) + 0.3 * std::pow(t, 7) + 0.4 * std::pow(t, 9);
  ExpectPixel(Project(camera, {0.0, -2.0, 2.0}), 360.0, 240.0 - 410.0 * bent, 1e-9);
  // On the axis there is no direction to bend in.
  ExpectPixel(Project(camera, {0.0, 0.0, 1.0}), 360.0, 240.0, 1e-12);
  ExpectPixel(Project(camera, {1e-7, 0.0, 1.0}), 360.0 + 400.0 * 1e-7, 240.0, 1e-9);
}

}  // namespace
}  // namespace dsg::ingest
