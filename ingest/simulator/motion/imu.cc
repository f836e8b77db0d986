// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/imu.h"

#include <cmath>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kImuStream = 0x696d75;  // "imu"

Eigen::Matrix3d DrawMisalignment(double sigma, Random* random) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  for (int column = 0; column < 3; ++column) matrix.col(column) += NormalVector(sigma, random);
  return matrix;
}

Eigen::Vector3d Cut(const Eigen::Vector3d& value, double bound) {
  return value.cwiseMin(bound).cwiseMax(-bound);
}

}  // namespace

Eigen::Vector3d NormalVector(double sigma, Random* random) {
  // One statement each: the order of evaluation decides which number goes where.
  const double x = random->Normal();
  const double y = random->Normal();
  const double z = random->Normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

ImuModel ImuModel::Perfect() {
  ImuModel model;
  model.noise_factor = 0.0;
  model.gyro_turn_on_bias = 0.0;
  model.accel_turn_on_bias = 0.0;
  return model;
}

std::vector<ImuSample> SimulateImu(const RobotMotion& motion, const ImuModel& model, double rate_hz,
                                   uint64_t seed) {
  DSG_CHECK(rate_hz > 0.0);
  Random random(seed, kImuStream);
  const double noise = model.noise_factor * std::sqrt(rate_hz);
  const double walk = model.noise_factor / std::sqrt(rate_hz);
  Eigen::Vector3d gyro_bias = NormalVector(model.gyro_turn_on_bias, &random);
  Eigen::Vector3d accel_bias = NormalVector(model.accel_turn_on_bias, &random);
  const Eigen::Matrix3d gyro_axes = DrawMisalignment(model.misalignment, &random);
  const Eigen::Matrix3d accel_axes = DrawMisalignment(model.misalignment, &random);
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravityM_S2);

  std::vector<ImuSample> samples;
  for (int64_t k = 0;; ++k) {
    const TimeNs time_ns = std::llround(static_cast<double>(k) * 1e9 / rate_hz);
    if (time_ns > motion.duration_ns()) break;
    const MotionState state = motion.StateAt(time_ns);
    const Eigen::Vector3d force =
        state.map_T_body.orientation.conjugate() * (state.acceleration_map - gravity);
    const Eigen::Vector3d gyro_noise = NormalVector(noise * model.gyro_noise_density, &random);
    const Eigen::Vector3d accel_noise = NormalVector(noise * model.accel_noise_density, &random);
    ImuSample sample;
    sample.time_ns = time_ns;
    sample.gyro_bias = gyro_bias;
    sample.accel_bias = accel_bias;
    sample.gyro =
        Cut(gyro_axes * state.angular_velocity_body + gyro_bias + gyro_noise, model.gyro_max);
    sample.accel = Cut(accel_axes * force + accel_bias + accel_noise, model.accel_max);
    samples.push_back(sample);
    gyro_bias += NormalVector(walk * model.gyro_random_walk, &random);
    accel_bias += NormalVector(walk * model.accel_random_walk, &random);
  }
  return samples;
}

}  // namespace dsg::simulator
