// SPDX-License-Identifier: Apache-2.0
// How a single-image human detector errs, as random draws made once and errors made of them.
// Refuses to draw twice: the rate of outliers can be changed without changing anything else.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "ingest/sensor/human_detection.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// Bodies less visible than this count as occluded.
inline constexpr double kFullyVisible = 0.99;
/// A detection's distance from the camera is never less.
inline constexpr double kDetectionDepthMinM = 0.5;
/// Outliers are never more frequent than this.
inline constexpr double kOutlierProbabilityMax = 0.5;

/// All the luck of one detection.
struct DetectionDraws {
  /// Logarithm of the depth factor of this image; normal, sd 0.05.
  double depth_log = 0.0;
  /// Of this person, the same in all images: the network believes in a mean height.
  double person_depth_log = 0.0;
  /// Standard normal.
  Eigen::Vector2d lateral = Eigen::Vector2d::Zero();
  Eigen::Vector2d occluded_lateral = Eigen::Vector2d::Zero();
  /// Uniform; an outlier if below the probability of one.
  double outlier_uniform = 1.0;
  /// Metres along the ray, negative = nearer.
  double outlier_m = 0.0;
  /// Standard normal.
  std::array<Eigen::Vector3d, ingest::kJointCount> joints;
  std::array<Eigen::Vector2d, ingest::kJointCount> pixels;
  std::array<Eigen::Vector3d, ingest::kJointCount> rotations;
  std::array<double, ingest::kShapeCount> shape{};
  double score = 0.0;
  double flip_uniform = 1.0;
};

DetectionDraws DrawDetectionErrors(double person_depth_log, Random* random);

/// Normal, sd 0.05, from the person alone.
double PersonDepthLog(uint64_t seed, int person);

/// Probability that a detection is an outlier, `scale` times the plain one of 3 %, or 15 % if it
/// is occluded.
double OutlierProbability(double visibility, double scale);

/// Where the detector believes the torso is. Depth factor exp(N(0, 0.05)) exp(h) v^-0.3, lateral
/// 1.5 % of the depth + (1 - v) N(0, 0.35) on each axis, outliers Exp(3 m) along the ray, three
/// quarters of them away. Frames: camera. Units: metres.
Eigen::Vector3d DetectedTorso(const Eigen::Vector3d& torso_camera, double visibility,
                              double outlier_scale, const DetectionDraws& draws);

/// Joints against the pelvis with 6 cm + (1 - v) 25 cm of noise (root mean square of the vector);
/// in 3 % of the detections with v < 0.5 left and right are mistaken. Frames: axes of the input.
std::array<Eigen::Vector3d, ingest::kJointCount> DetectedJoints(
    const std::array<Eigen::Vector3d, ingest::kJointCount>& joints, double visibility,
    const DetectionDraws& draws);

/// Whether left and right are mistaken.
bool IsFlipped(double visibility, const DetectionDraws& draws);

/// The joint on the other side of the body; the same for those in the middle.
int MirrorJoint(int joint);

}  // namespace dsg::simulator
