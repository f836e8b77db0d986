// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/estimation/walker.h"

#include <Eigen/Geometry>
#include <cmath>

namespace dsg::ingest {

Pose3d TorsoAt(const Eigen::Vector3d& position, double heading) {
  Pose3d pose;
  pose.position = position;
  pose.orientation = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ());
  return pose;
}

TorsoOptions Paper() {
  TorsoOptions options;
  options.model = TorsoModel::kPaper;
  return options;
}

TimeNs TimeOf(int i) { return kWalkBeginNs + i * TimeNs{200'000'000}; }

double Heading(const Pose3d& pose) {
  const Eigen::Vector3d x = pose.orientation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

PersonObservation StandingAt(double x, TimeNs time_ns) {
  PersonObservation observation;
  observation.time_ns = time_ns;
  observation.map_T_torso = TorsoAt(Eigen::Vector3d(x, 0.0, 0.95), 0.5);
  observation.position_covariance_map = 0.04 * Eigen::Matrix3d::Identity();
  observation.camera_map = Eigen::Vector3d(0.0, -5.0, 1.2);
  return observation;
}

PersonObservation Seen(const Pose3d& map_T_torso, const Eigen::Vector3d& camera_map, TimeNs time_ns,
                       const WalkerOptions& options, Random* random) {
  Eigen::Matrix3d frame;
  frame.col(2) = (map_T_torso.position - camera_map).normalized();
  frame.col(0) = frame.col(2).unitOrthogonal();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  const Eigen::Vector3d sigma(options.across_sigma_m, options.across_sigma_m, options.ray_sigma_m);
  Eigen::Vector3d noise;
  for (int axis = 0; axis < 3; ++axis) noise(axis) = sigma(axis) * random->Normal();
  PersonObservation observation;
  observation.time_ns = time_ns;
  observation.camera_map = camera_map;
  observation.position_covariance_map = frame * sigma.cwiseAbs2().asDiagonal() * frame.transpose();
  observation.map_T_torso = map_T_torso;
  observation.map_T_torso.position += frame * noise;
  if (random->Chance(options.outlier_probability)) {
    const double angle = random->Uniform(0.0, 6.28);
    observation.map_T_torso.position +=
        options.outlier_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
  }
  const Eigen::AngleAxisd turn(options.heading_sigma_rad * random->Normal(),
                               Eigen::Vector3d::UnitZ());
  observation.map_T_torso.orientation = turn * map_T_torso.orientation;
  observation.heading_sigma_rad = options.heading_sigma_rad;
  if (options.cue_sigma_m > 0.0) {
    PositionCue cue;
    cue.torso_map = map_T_torso.position + options.cue_sigma_m * random->Normal() * frame.col(2);
    cue.information_map =
        frame.col(2) * frame.col(2).transpose() / (options.cue_sigma_m * options.cue_sigma_m);
    observation.cues.push_back(cue);
  }
  return observation;
}

Walk WalkCircle(const WalkerOptions& options, uint64_t seed) {
  Random random(seed, 0);
  Walk walk;
  for (int i = 0; i < options.count; ++i) {
    const double angle =
        options.speed_m_s / options.radius_m * 1e-9 * static_cast<double>(i * options.step_ns);
    const Eigen::Vector3d position(4.0 + options.radius_m * std::cos(angle),
                                   options.radius_m * std::sin(angle), 0.95);
    const Pose3d pose = TorsoAt(position, angle + 1.5707963267948966);
    walk.map_T_torso.push_back(pose);
    walk.observations.push_back(Seen(pose, Eigen::Vector3d(0.0, -4.0, 1.2),
                                     kWalkBeginNs + i * options.step_ns, options, &random));
  }
  return walk;
}

TorsoGraph Track(const TorsoOptions& options, const std::vector<PersonObservation>& observations) {
  TorsoGraph graph(options);
  for (const PersonObservation& observation : observations) {
    graph.Add(observation);
    graph.SolveRecent();
  }
  return graph;
}

double MeanError(const std::vector<TorsoEstimate>& estimates, const std::vector<Pose3d>& truth) {
  double sum = 0.0;
  for (size_t i = 0; i < estimates.size(); ++i) {
    sum += (estimates[i].map_T_torso.position - truth[i].position).norm();
  }
  return sum / static_cast<double>(estimates.size());
}

double MeanRawError(const Walk& walk) {
  double sum = 0.0;
  for (size_t i = 0; i < walk.observations.size(); ++i) {
    sum += (walk.observations[i].map_T_torso.position - walk.map_T_torso[i].position).norm();
  }
  return sum / static_cast<double>(walk.observations.size());
}

Eigen::Matrix3d PositionCovariance(const TorsoEstimate& estimate) {
  const Covariance6& upper = estimate.covariance;
  Eigen::Matrix3d covariance;
  covariance << upper[0], upper[1], upper[2], upper[1], upper[6], upper[7], upper[2], upper[7],
      upper[11];
  return covariance;
}

}  // namespace dsg::ingest
