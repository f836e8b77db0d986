// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/detection_error.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

constexpr uint64_t kPersonStream = uint64_t{5} << 32;
constexpr double kDepthLogSd = 0.05;
constexpr double kPersonDepthLogSd = 0.05;
constexpr double kOcclusionExponent = -0.3;
constexpr double kLateralShare = 0.015;
constexpr double kOccludedLateralM = 0.35;
constexpr double kOutlierProbability = 0.03;
constexpr double kOccludedOutlierFactor = 5.0;
constexpr double kOutlierMeanM = 3.0;
constexpr double kOutlierAway = 0.75;
constexpr double kJointNoiseM = 0.06;
constexpr double kOccludedJointNoiseM = 0.25;
constexpr double kFlipProbability = 0.03;
constexpr double kFlipVisibility = 0.5;

Eigen::Vector3d Normal3(Random* random) {
  // One statement each: the order of arguments' evaluation is not fixed.
  const double x = random->Normal();
  const double y = random->Normal();
  const double z = random->Normal();
  return {x, y, z};
}

Eigen::Vector2d Normal2(Random* random) {
  const double x = random->Normal();
  const double y = random->Normal();
  return {x, y};
}

}  // namespace

DetectionDraws DrawDetectionErrors(double person_depth_log, Random* random) {
  DetectionDraws draws;
  draws.person_depth_log = person_depth_log;
  draws.depth_log = kDepthLogSd * random->Normal();
  draws.lateral = Normal2(random);
  draws.occluded_lateral = Normal2(random);
  draws.outlier_uniform = random->Uniform();
  const double away = random->Chance(kOutlierAway) ? 1.0 : -1.0;
  draws.outlier_m = away * kOutlierMeanM * random->Exponential();
  for (Eigen::Vector3d& noise : draws.joints) noise = Normal3(random);
  for (Eigen::Vector2d& noise : draws.pixels) noise = Normal2(random);
  for (Eigen::Vector3d& noise : draws.rotations) noise = Normal3(random);
  for (double& noise : draws.shape) noise = random->Normal();
  draws.score = random->Normal();
  draws.flip_uniform = random->Uniform();
  return draws;
}

double PersonDepthLog(uint64_t seed, int person) {
  return kPersonDepthLogSd * Random(seed, kPersonStream + static_cast<uint64_t>(person)).Normal();
}

double OutlierProbability(double visibility, double scale) {
  const double occluded = visibility < kFullyVisible ? kOccludedOutlierFactor : 1.0;
  return std::min(kOutlierProbabilityMax, scale * kOutlierProbability * occluded);
}

Eigen::Vector3d DetectedTorso(const Eigen::Vector3d& torso_camera, double visibility,
                              double outlier_scale, const DetectionDraws& draws) {
  const double factor =
      std::exp(draws.depth_log + draws.person_depth_log) * std::pow(visibility, kOcclusionExponent);
  Eigen::Vector3d torso = factor * torso_camera;
  const Eigen::Vector3d ray = torso_camera.normalized();
  if (draws.outlier_uniform < OutlierProbability(visibility, outlier_scale)) {
    torso += draws.outlier_m * ray;
  }
  // Never behind the camera: the network saw the person.
  if (torso.z() < kDetectionDepthMinM) {
    torso = torso_camera * (kDetectionDepthMinM / torso_camera.z());
  }
  torso.head<2>() += kLateralShare * torso_camera.z() * draws.lateral +
                     kOccludedLateralM * (1.0 - visibility) * draws.occluded_lateral;
  return torso;
}

bool IsFlipped(double visibility, const DetectionDraws& draws) {
  return visibility < kFlipVisibility && draws.flip_uniform < kFlipProbability;
}

int MirrorJoint(int joint) {
  static constexpr std::array<int, ingest::kJointCount> kMirror = {
      0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22};
  return kMirror[static_cast<size_t>(joint)];
}

std::array<Eigen::Vector3d, ingest::kJointCount> DetectedJoints(
    const std::array<Eigen::Vector3d, ingest::kJointCount>& joints, double visibility,
    const DetectionDraws& draws) {
  const double rms_m = kJointNoiseM + kOccludedJointNoiseM * (1.0 - visibility);
  const double sd_m = rms_m / std::sqrt(3.0);
  const bool flipped = IsFlipped(visibility, draws);
  std::array<Eigen::Vector3d, ingest::kJointCount> noisy;
  for (int j = 0; j < ingest::kJointCount; ++j) {
    noisy[j] = joints[flipped ? MirrorJoint(j) : j] + sd_m * draws.joints[j];
  }
  const Eigen::Vector3d pelvis = noisy[ingest::kPelvis];
  for (Eigen::Vector3d& joint : noisy) joint -= pelvis;
  return noisy;
}

}  // namespace dsg::simulator
