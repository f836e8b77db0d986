// SPDX-License-Identifier: Apache-2.0
// A calibration as the sensor.yaml files of an EuRoC folder.
// Refuses distorted cameras: the simulated ones are ideal pinholes.
#pragma once

#include <string>

#include "ingest/sensor/calibration.h"

namespace dsg::simulator {

/// Requires: Distortion::kNone.
std::string CameraYaml(const ingest::CameraCalibration& camera);
std::string ImuYaml(const ingest::ImuCalibration& imu);
/// Of the ground truth: the body frame is that of the inertial unit.
std::string GroundTruthYaml();

}  // namespace dsg::simulator
