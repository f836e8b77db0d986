// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/dead_reckoning.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "schema/model/rotation.h"

namespace dsg::simulator {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

// 95 % quantiles of chi-squared with three and nine degrees of freedom.
constexpr double kChiSquared3 = 7.8147;
constexpr double kChiSquared9 = 16.9190;

struct Step {
  double dt_s = 0.0;
  Vector3d turn = Vector3d::Zero();
  Vector3d accel = Vector3d::Zero();
};

// The step from samples[i - 1] to samples[i].
Step StepTo(std::span<const ImuSample> samples, size_t i, const Vector3d& gyro_bias,
            const Vector3d& accel_bias) {
  const ImuSample& from = samples[i - 1];
  const ImuSample& to = samples[i];
  const double dt_s = 1e-9 * static_cast<double>(to.time_ns - from.time_ns);
  const Vector3d w0 = from.gyro - gyro_bias;
  const Vector3d w1 = to.gyro - gyro_bias;
  Vector3d mean = 0.5 * (w0 + w1);
  if (i >= 2 && i + 1 < samples.size()) {
    // The integral of the cubic through four samples over its middle third.
    mean += (from.gyro - samples[i - 2].gyro + to.gyro - samples[i + 1].gyro) / 24.0;
  }
  // The last term is what rates that turn themselves add (Magnus, second term).
  return {dt_s, dt_s * mean + dt_s * dt_s / 12.0 * w0.cross(w1),
          0.5 * (from.accel + to.accel) - accel_bias};
}

// One step of the covariance of (rotation, velocity, position, gyro bias, accel bias).
void Propagate(const Step& step, const Matrix3d& map_R_body, const ImuModel& model,
               Matrix15d* covariance) {
  const double dt = step.dt_s;
  const Matrix3d turned = RotationOf(step.turn).toRotationMatrix();
  const Matrix3d jr = RightJacobian(step.turn);
  const Matrix3d lever = -map_R_body * CrossMatrix(step.accel) * dt;
  Matrix15d a = Matrix15d::Identity();
  a.block<3, 3>(0, 0) = turned.transpose();
  a.block<3, 3>(0, 9) = -jr * dt;
  a.block<3, 3>(3, 0) = lever;
  a.block<3, 3>(3, 12) = -map_R_body * dt;
  a.block<3, 3>(6, 0) = 0.5 * dt * lever;
  a.block<3, 3>(6, 3) = Matrix3d::Identity() * dt;
  a.block<3, 3>(6, 12) = -0.5 * dt * dt * map_R_body;
  Eigen::Matrix<double, 15, 6> b = Eigen::Matrix<double, 15, 6>::Zero();
  b.block<3, 3>(0, 0) = jr * dt;
  b.block<3, 3>(3, 3) = map_R_body * dt;
  b.block<3, 3>(6, 3) = 0.5 * dt * dt * map_R_body;
  const auto variance = [&](double density) {
    return std::pow(model.noise_factor * density, 2) * Vector3d::Ones();
  };
  Eigen::Matrix<double, 6, 1> noise;
  noise << variance(model.gyro_noise_density) / dt, variance(model.accel_noise_density) / dt;
  Matrix15d next = a * *covariance * a.transpose();
  next += b * noise.asDiagonal() * b.transpose();
  next.diagonal().segment<3>(9) += variance(model.gyro_random_walk) * dt;
  next.diagonal().tail<3>() += variance(model.accel_random_walk) * dt;
  *covariance = next;
}

NavigationState TruthAt(const RobotMotion& motion, TimeNs time_ns) {
  const MotionState state = motion.StateAt(time_ns);
  return {state.map_T_body, state.velocity_map};
}

template <int kSize>
double MahalanobisSquared(const ReckonedWindow& window, int first) {
  const Eigen::Matrix<double, kSize, kSize> covariance =
      window.covariance.block<kSize, kSize>(first, first);
  const Eigen::Matrix<double, kSize, 1> error = window.error.segment<kSize>(first);
  return error.dot(covariance.llt().solve(error));
}

}  // namespace

std::vector<NavigationState> IntegrateImu(std::span<const ImuSample> samples,
                                          const NavigationState& start, const Vector3d& gyro_bias,
                                          const Vector3d& accel_bias) {
  const Vector3d gravity(0.0, 0.0, -kGravityM_S2);
  std::vector<NavigationState> states = {start};
  states.reserve(samples.size());
  for (size_t i = 1; i < samples.size(); ++i) {
    const Step step = StepTo(samples, i, gyro_bias, accel_bias);
    NavigationState state = states.back();
    const Eigen::Quaterniond before = state.map_T_body.orientation;
    const Eigen::Quaterniond after = (before * RotationOf(step.turn)).normalized();
    const Vector3d a0 = before * (samples[i - 1].accel - accel_bias) + gravity;
    const Vector3d a1 = after * (samples[i].accel - accel_bias) + gravity;
    const double dt = step.dt_s;
    state.map_T_body.position += dt * state.velocity_map + dt * dt / 6.0 * (2.0 * a0 + a1);
    state.velocity_map += 0.5 * dt * (a0 + a1);
    state.map_T_body.orientation = after;
    states.push_back(state);
  }
  return states;
}

Matrix9d PredictCovariance(std::span<const ImuSample> samples, const NavigationState& start,
                           const ImuModel& model) {
  Matrix15d covariance = Matrix15d::Zero();
  Eigen::Quaterniond map_R_body = start.map_T_body.orientation;
  const ImuSample& first = samples.front();
  for (size_t i = 1; i < samples.size(); ++i) {
    const Step step = StepTo(samples, i, first.gyro_bias, first.accel_bias);
    Propagate(step, map_R_body.toRotationMatrix(), model, &covariance);
    map_R_body = (map_R_body * RotationOf(step.turn)).normalized();
  }
  return covariance.topLeftCorner<9, 9>();
}

std::vector<ReckonedWindow> ReckonWindows(const RobotMotion& motion,
                                          std::span<const ImuSample> samples, const ImuModel& model,
                                          TimeNs window_ns) {
  std::vector<ReckonedWindow> windows;
  size_t begin = 0;
  for (size_t end = 0; end < samples.size(); ++end) {
    if (samples[end].time_ns - samples[begin].time_ns < window_ns) continue;
    const std::span<const ImuSample> inside = samples.subspan(begin, end - begin + 1);
    const NavigationState start = TruthAt(motion, samples[begin].time_ns);
    const NavigationState truth = TruthAt(motion, samples[end].time_ns);
    const NavigationState reckoned =
        IntegrateImu(inside, start, inside.front().gyro_bias, inside.front().accel_bias).back();
    ReckonedWindow window;
    window.begin_ns = samples[begin].time_ns;
    window.error << RotationVectorOf(truth.map_T_body.orientation.conjugate() *
                                     reckoned.map_T_body.orientation),
        reckoned.velocity_map - truth.velocity_map,
        reckoned.map_T_body.position - truth.map_T_body.position;
    window.covariance = PredictCovariance(inside, start, model);
    windows.push_back(window);
    begin = end;
  }
  return windows;
}

ReckoningShares SharesWithin(const std::vector<ReckonedWindow>& windows) {
  ReckoningShares shares;
  shares.window_count = static_cast<int>(windows.size());
  if (windows.empty()) return shares;
  for (const ReckonedWindow& window : windows) {
    shares.rotation += MahalanobisSquared<3>(window, 0) <= kChiSquared3 ? 1.0 : 0.0;
    shares.position += MahalanobisSquared<3>(window, 6) <= kChiSquared3 ? 1.0 : 0.0;
    shares.all += MahalanobisSquared<9>(window, 0) <= kChiSquared9 ? 1.0 : 0.0;
  }
  shares.rotation /= shares.window_count;
  shares.position /= shares.window_count;
  shares.all /= shares.window_count;
  return shares;
}

}  // namespace dsg::simulator
