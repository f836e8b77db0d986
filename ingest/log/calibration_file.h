// SPDX-License-Identifier: Apache-2.0
// Calibrations as files hold them: the sensor.yaml of EuRoC and of Kimera, and lists of poses.
// Refuses to fill in what a file leaves out: a wrong calibration looks like a bad sensor.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// T_BS, rate_hz, resolution, camera_model, intrinsics, distortion_model,
/// distortion_coefficients. OpenCV's headers and matrix tags are accepted. Files are at most 1 MiB.
/// Errors of all: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field and value.
absl::StatusOr<CameraCalibration> ReadCameraYaml(const LogFile& file, const std::string& name);

/// What programs of RGB-D odometry are set up with.
struct RgbdSettings {
  /// Without name and size.
  CameraCalibration camera;
  double depth_units_per_m = 1000.0;
};

/// Camera.fx, .fy, .cx, .cy, .k1, .k2, .p1, .p2, .k3 (zero if missing) and DepthMapFactor: the
/// settings of ORB-SLAM2.
absl::StatusOr<RgbdSettings> ReadRgbdSettings(const LogFile& file);

/// T_BS (identity if missing), rate_hz, noise densities and random walks.
absl::StatusOr<ImuCalibration> ReadImuYaml(const LogFile& file, const std::string& name);

struct NumberedPose {
  int64_t number = 0;
  Pose3d map_T_camera;
};

/// {0: {q: {w, x, y, z}, t: {x, y, z}}, 1: ...}, ascending by number.
absl::StatusOr<std::vector<NumberedPose>> ReadPosesYaml(const LogFile& file);

}  // namespace dsg::ingest
