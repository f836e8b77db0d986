// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/rig_files.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

// Body from sensor, row by row.
std::string Transform(const Pose3d& body_T_sensor) {
  const Eigen::Matrix3d r = body_T_sensor.orientation.toRotationMatrix();
  std::string rows;
  for (int row = 0; row < 3; ++row) {
    absl::StrAppendFormat(&rows, "%.12f, %.12f, %.12f, %.12f,\n         ", r(row, 0), r(row, 1),
                          r(row, 2), body_T_sensor.position[row]);
  }
  return absl::StrCat("# Sensor frame to body frame.\nT_BS:\n  cols: 4\n  rows: 4\n  data: [", rows,
                      "0.0, 0.0, 0.0, 1.0]\n");
}

}  // namespace

std::string CameraYaml(const ingest::CameraCalibration& camera) {
  DSG_CHECK(camera.distortion == ingest::Distortion::kNone);
  return absl::StrCat(
      "sensor_type: camera\ncomment: simulated, ", camera.name, "\n",
      Transform(camera.body_T_camera),
      absl::StrFormat("rate_hz: %g\nresolution: [%d, %d]\ncamera_model: pinhole\n"
                      "# fu, fv, cu, cv, pixels\nintrinsics: [%.9f, %.9f, %.9f, %.9f]\n"
                      "distortion_model: none\ndistortion_coefficients: []\n",
                      camera.rate_hz, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                      camera.cy));
}

std::string ImuYaml(const ingest::ImuCalibration& imu) {
  return absl::StrCat("sensor_type: imu\ncomment: simulated, noise of an ADIS16448\n",
                      Transform(imu.body_T_imu),
                      absl::StrFormat("rate_hz: %g\n"
                                      "gyroscope_noise_density: %.9g      # rad / s / sqrt(Hz)\n"
                                      "gyroscope_random_walk: %.9g        # rad / s^2 / sqrt(Hz)\n"
                                      "accelerometer_noise_density: %.9g  # m / s^2 / sqrt(Hz)\n"
                                      "accelerometer_random_walk: %.9g    # m / s^3 / sqrt(Hz)\n",
                                      imu.rate_hz, imu.gyro_noise_density, imu.gyro_random_walk,
                                      imu.accel_noise_density, imu.accel_random_walk));
}

std::string GroundTruthYaml() {
  return absl::StrCat("sensor_type: visual-inertial\ncomment: simulated, exact\n",
                      Transform(Pose3d()));
}

}  // namespace dsg::simulator
