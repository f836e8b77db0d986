// SPDX-License-Identifier: Apache-2.0
// Calibrations from YAML: EuRoC's and OpenCV's forms, and errors that name file, field and value.
#include "ingest/log/calibration_file.h"

#include <gtest/gtest.h>

#include <random>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr char kCamera[] =
    "sensor_type: camera\n"
    "T_BS:\n"
    "  cols: 4\n"
    "  rows: 4\n"
    "  data: [0.0, -1.0, 0.0, 0.1,\n"
    "         1.0, 0.0, 0.0, 0.2,\n"
    "         0.0, 0.0, 1.0, 0.3,\n"
    "         0.0, 0.0, 0.0, 1.0]\n"
    "rate_hz: 20\n"
    "resolution: [752, 480]\n"
    "camera_model: pinhole\n"
    "intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv\n"
    "distortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.28, 0.07, 0.0002, 1.76187114e-05]\n";

constexpr char kImu[] =
    "sensor_type: imu\n"
    "T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    "rate_hz: 200\n"
    "gyroscope_noise_density: 1.6968e-04 # [ rad / s / sqrt(Hz) ]\n"
    "gyroscope_random_walk: 1.9393e-05\n"
    "accelerometer_noise_density: 2.0000e-3\n"
    "accelerometer_random_walk: 3.0000e-3\n";

LogFile File(const std::string& bytes) { return {"sensor.yaml", "sensor.yaml", bytes}; }

void ExpectCameraError(const std::string& bytes, const std::vector<std::string>& parts) {
  ExpectMalformedFile(ReadCameraYaml(File(bytes), "cam0").status(), parts);
}

TEST(CalibrationFile, ReadsACamera) {
  const auto camera = ReadCameraYaml(File(kCamera), "cam0");
  ASSERT_TRUE(camera.ok()) << camera.status();
  EXPECT_EQ(camera->name, "cam0");
  EXPECT_EQ(camera->width, 752);
  EXPECT_EQ(camera->height, 480);
  EXPECT_EQ(camera->fy, 457.296);
  EXPECT_EQ(camera->cx, 367.215);
  EXPECT_EQ(camera->rate_hz, 20.0);
  EXPECT_EQ(camera->distortion, Distortion::kRadialTangential);
  EXPECT_EQ(camera->distortion_coefficients.back(), 1.76187114e-05);
  EXPECT_EQ(camera->body_T_camera.position, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_NEAR(
      (camera->body_T_camera.orientation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY())
          .norm(),
      0.0, 1e-12);
}

TEST(CalibrationFile, AcceptsOpenCvsHeaderAndTags) {
  const std::string text = "%YAML:1.0\n---\n" + Changed(kCamera, "T_BS:", "T_BS: !!opencv-matrix");
  EXPECT_TRUE(ReadCameraYaml(File(text), "cam0").ok())
      << ReadCameraYaml(File(text), "cam0").status();
  EXPECT_TRUE(ReadCameraYaml(File(std::string("%YAML:1.0\n") + kCamera), "cam0").ok());
}

TEST(CalibrationFile, ReadsEquidistantAndNone) {
  const auto fisheye =
      ReadCameraYaml(File(Changed(kCamera, "radial-tangential", "equidistant")), "cam0");
  ASSERT_TRUE(fisheye.ok()) << fisheye.status();
  EXPECT_EQ(fisheye->distortion, Distortion::kEquidistant);
  const auto none = ReadCameraYaml(File(Changed(kCamera, "radial-tangential", "none")), "cam0");
  ASSERT_TRUE(none.ok()) << none.status();
  EXPECT_EQ(none->distortion, Distortion::kNone);
}

TEST(CalibrationFile, ReadsAnInertialUnit) {
  const auto imu = ReadImuYaml(File(kImu), "imu0");
  ASSERT_TRUE(imu.ok()) << imu.status();
  EXPECT_EQ(imu->rate_hz, 200.0);
  EXPECT_EQ(imu->gyro_noise_density, 1.6968e-04);
  EXPECT_EQ(imu->accel_random_walk, 3.0e-3);
  EXPECT_EQ(ReasonOf(ReadImuYaml(File(kCamera), "imu0").status()), Reason::kFileMalformed);
  EXPECT_EQ(ReasonOf(ReadImuYaml(File(Changed(kImu, "3.0000e-3", "-1")), "imu0").status()),
            Reason::kFileMalformed);
}

TEST(CalibrationFile, NamesFileLineFieldAndValue) {
  ExpectCameraError(Changed(kCamera, "458.654", "-458.654"), {"sensor.yaml", "fx", "-458.654"});
  ExpectCameraError(Changed(kCamera, "458.654", "many"), {"sensor.yaml:12", "intrinsics", "many"});
  ExpectCameraError(Changed(kCamera, "458.654, ", ""), {"intrinsics", "3 numbers"});
  ExpectCameraError(Changed(kCamera, "752", "0"), {"width", "0"});
  ExpectCameraError(Changed(kCamera, "752", "1e9"), {"resolution"});
  ExpectCameraError(Changed(kCamera, "752", ".nan"), {"resolution"});
  ExpectCameraError(Changed(kCamera, "pinhole", "omni"), {"camera_model", "omni"});
  ExpectCameraError(Changed(kCamera, "radial-tangential", "fov"), {"distortion_model", "fov"});
  ExpectCameraError(Changed(kCamera, ", 1.76187114e-05", ""), {"distortion_coefficients"});
  ExpectCameraError(Changed(kCamera, "sensor_type: camera", "sensor_type: imu"),
                    {"sensor_type", "imu"});
  ExpectCameraError(Changed(kCamera, "T_BS", "T_SB"), {"T_BS", "missing"});
  ExpectCameraError(Changed(kCamera, "-1.0", "-1.5"), {"T_BS", "rotation"});
  ExpectCameraError(Changed(kCamera, "-1.0", "1.0"), {"T_BS", "rotation"});
  ExpectCameraError(Changed(kCamera, "0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 0.0]"), {"T_BS", "15"});
  ExpectCameraError("just text", {"no map"});
  ExpectCameraError("a: [1, 2", {"YAML"});
  ExpectCameraError("a: *nobody", {"YAML"});
}

TEST(CalibrationFile, RefusesLargeAndDeepFiles) {
  ExpectCameraError(std::string((size_t{1} << 20) + 1, 'a'), {"bytes"});
  ExpectCameraError("a: " + std::string(200'000, '['), {"deep"});
  ExpectCameraError("a:\n" + std::string(20'000, '-') + " 1", {});
  std::string dashes = "a:\n";
  for (int i = 0; i < 5000; ++i) dashes += "- ";
  ExpectCameraError(dashes, {"deep"});
  std::string steps;
  for (int i = 0; i < 600; ++i) steps += std::string(static_cast<size_t>(i), ' ') + "a:\n";
  ExpectCameraError(steps, {});
}

TEST(CalibrationFile, ReadsListsOfPoses) {
  const auto poses =
      ReadPosesYaml(File("{1: {q: {w: 1, x: 0, y: 0, z: 0}, t: {x: 1, y: 2, z: 3}},\n"
                         " 0: {q: {w: 0, x: 1, y: 0, z: 0}, t: {x: 4, y: 5, z: 6}}}\n"));
  ASSERT_TRUE(poses.ok()) << poses.status();
  ASSERT_EQ(poses->size(), 2u);
  EXPECT_EQ((*poses)[0].number, 0);
  EXPECT_EQ((*poses)[0].map_T_camera.position, Eigen::Vector3d(4, 5, 6));
  EXPECT_FALSE(ReadPosesYaml(File("{0: {q: {w: 2, x: 0, y: 0, z: 0}, t: {x: 1}}}")).ok());
  EXPECT_FALSE(ReadPosesYaml(File("{a: 1}")).ok());
}

TEST(CalibrationFile, SurvivesAnyCutAndAnyChangedByte) {
  constexpr unsigned kSeed = 20160112;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const std::string text = kCamera;
  const auto check = [](const std::string& changed) {
    const auto camera = ReadCameraYaml(File(changed), "cam0");
    EXPECT_TRUE(camera.ok() || ReasonOf(camera.status()) == Reason::kFileMalformed)
        << camera.status();
  };
  for (size_t size = 0; size < text.size(); ++size) check(text.substr(0, size));
  for (int i = 0; i < 2000; ++i) {
    std::string changed = text;
    changed[random() % changed.size()] = static_cast<char>(random() % 256);
    check(changed);
  }
}

}  // namespace
}  // namespace dsg::ingest
