// SPDX-License-Identifier: Apache-2.0
// Samples and states for the tests of this folder.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/base/random.h"

namespace dsg::ingest {

/// The unit of EuRoC's logs, as their sensor.yaml has it.
inline ImuCalibration Adis16448() {
  ImuCalibration unit;
  unit.name = "imu0";
  unit.rate_hz = 200.0;
  unit.gyro_noise_density = 1.6968e-4;
  unit.gyro_random_walk = 1.9393e-5;
  unit.accel_noise_density = 2.0e-3;
  unit.accel_random_walk = 3.0e-3;
  return unit;
}

inline Eigen::Vector3d NormalVector(double sigma, Random* random) {
  const double x = random->Normal();
  const double y = random->Normal();
  return sigma * Eigen::Vector3d(x, y, random->Normal());
}

/// What a unit measures that is swung by a hand, without noise: rates up to 1 rad/s.
inline ImuMeasurement SwungSample(double time_s) {
  const double t = time_s;
  return {std::llround(1e9 * time_s),
          {0.6 * std::sin(2.0 * t + 0.3), 0.5 * std::cos(3.0 * t), 0.4 + 0.5 * std::sin(t)},
          {1.0 + 2.0 * std::sin(2.5 * t), 0.8 * std::cos(1.7 * t), 9.81 + std::sin(3.0 * t + 1.0)}};
}

/// From 0 to `duration_s`, both included.
inline std::vector<ImuMeasurement> SwungSamples(double duration_s, double rate_hz) {
  std::vector<ImuMeasurement> samples;
  const int count = static_cast<int>(std::lround(duration_s * rate_hz));
  for (int i = 0; i <= count; ++i) samples.push_back(SwungSample(i / rate_hz));
  return samples;
}

/// White noise and walking biases added, those of `unit`, from biases of 0; `bias` becomes the one
/// at the end.
inline std::vector<ImuMeasurement> Noisy(std::vector<ImuMeasurement> samples,
                                         const ImuCalibration& unit, Random* random,
                                         ImuBias* bias) {
  *bias = ImuBias();
  const double dt = 1.0 / unit.rate_hz;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) {
      bias->gyro_rad_s += NormalVector(unit.gyro_random_walk * std::sqrt(dt), random);
      bias->accel_m_s2 += NormalVector(unit.accel_random_walk * std::sqrt(dt), random);
    }
    samples[i].angular_velocity_rad_s +=
        bias->gyro_rad_s + NormalVector(unit.gyro_noise_density / std::sqrt(dt), random);
    samples[i].acceleration_m_s2 +=
        bias->accel_m_s2 + NormalVector(unit.accel_noise_density / std::sqrt(dt), random);
  }
  return samples;
}

inline Vector15d RandomStep15(double scale, Random* random) {
  Vector15d step;
  for (double& value : step) value = scale * random->Uniform(-1.0, 1.0);
  return step;
}

/// Any pose within metres, speeds of metres a second, biases like those of cheap units.
inline InertialState AnyState(Random* random) {
  Vector15d step = RandomStep15(1.7, random);
  step.tail<6>() *= 0.01;
  return Stepped(InertialState(), step);
}

}  // namespace dsg::ingest
