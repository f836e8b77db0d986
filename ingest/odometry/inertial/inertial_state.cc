// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/inertial_state.h"

namespace dsg::ingest {

InertialState Stepped(const InertialState& state, const Vector15d& step) {
  return {Stepped(state.map_T_imu, step.head<kPoseStepSize>()),
          state.velocity_map + step.segment<3>(kVelocityRow),
          {state.bias.gyro_rad_s + step.segment<3>(kGyroBiasRow),
           state.bias.accel_m_s2 + step.segment<3>(kAccelBiasRow)}};
}

Vector15d StepBetween(const InertialState& from, const InertialState& to) {
  Vector15d step;
  step << StepBetween(from.map_T_imu, to.map_T_imu), to.velocity_map - from.velocity_map,
      to.bias.gyro_rad_s - from.bias.gyro_rad_s, to.bias.accel_m_s2 - from.bias.accel_m_s2;
  return step;
}

void WriteSpeedBlock(const InertialState& state, double* block) {
  Eigen::Map<Eigen::Matrix<double, kSpeedBlockSize, 1>>{block} << state.velocity_map,
      state.bias.gyro_rad_s, state.bias.accel_m_s2;
}

InertialState StateOfBlocks(const double* pose_block, const double* speed_block) {
  return {PoseOfBlock(pose_block),
          Eigen::Vector3d(speed_block),
          {Eigen::Vector3d(speed_block + 3), Eigen::Vector3d(speed_block + 6)}};
}

}  // namespace dsg::ingest
