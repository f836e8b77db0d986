// SPDX-License-Identifier: Apache-2.0
// The camera of the tests of this folder.
#pragma once

#include "ingest/sensor/calibration.h"

namespace dsg::ingest {

/// 320 x 240 pixels of 1/200 without distortion, 1 m above the robot and looking along its x.
inline CameraCalibration MakeCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 200.0;
  camera.cx = 160.0;
  camera.cy = 120.0;
  camera.body_T_camera = {Eigen::Vector3d(0, 0, 1), Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};
  return camera;
}

}  // namespace dsg::ingest
