// SPDX-License-Identifier: Apache-2.0
// Camera poses and intrinsics as the folders of RGB-D datasets write them.
// Refuses matrices that are not rigid.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>

#include "absl/status/statusor.h"
#include "ingest/log/file_bytes.h"
#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// Poses by frame, and how far their matrices were from rotations.
struct FramePoses {
  std::map<int64_t, Pose3d> map_T_camera;
  /// Stamps, where the file has some.
  std::map<int64_t, TimeNs> stamps;
  double deviation_max = 0.0;
};

/// One 4x4 matrix in a file of its own. Errors of all: FILE_MALFORMED naming file and line.
absl::Status AddMatrixFile(const LogFile& file, int64_t frame, FramePoses* poses);
/// Five lines a pose: three integers, the first of which is the frame, and a 4x4 matrix.
absl::StatusOr<FramePoses> ReadRedwoodTrajectory(const LogFile& file);
/// Sixteen numbers a line, one line a frame.
absl::StatusOr<FramePoses> ReadMatrixLines(const LogFile& file);
/// index,role,pair,timestamp_ns,qw,qx,qy,qz,px,py,pz: poses of the body.
absl::StatusOr<FramePoses> ReadIndexedPoses(const LogFile& file);

/// A 3x3 matrix: fx 0 cx, 0 fy cy, 0 0 1.
absl::Status ReadIntrinsics(const LogFile& file, CameraCalibration* camera);

}  // namespace dsg::ingest
