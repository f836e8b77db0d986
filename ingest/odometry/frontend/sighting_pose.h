// SPDX-License-Identifier: Apache-2.0
// Where two frames stand to each other, from points that are known in one of them and seen by a
// camera of the other, of which many may be wrong.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "ingest/odometry/frontend/consensus.h"
#include "ingest/sensor/calibration.h"
#include "ingest/solver/pose_block.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// A point that one frame knows, and where the camera of the other one sees it.
///
/// The error is in pixels of that camera, and in its inverse depth if it knows one too (there
/// errors of stereo are normal). Its covariance is that of both sightings and of the point's depth,
/// which moves the projection along a line.
struct PointSighting {
  /// The frame `from` knows the point, and the camera `to` sees it; else the other way round.
  bool is_forward = true;
  /// In the frame that knows it, and by how much one standard deviation of its depth moves it.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d depth_step = Eigen::Vector3d::Zero();
  /// Standard deviation of the point across its ray, metres.
  double aside_sigma_m = 0.0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double pixel_sigma_px = 1.0;
  /// 1 / metres; a standard deviation of 0 is of no depth.
  double inverse_depth = 0.0;
  double inverse_sigma = 0.0;
};

struct SightingPoseOptions {
  /// A sighting agrees with a pose that it misses by this at most: its squared error in units of
  /// its covariance.
  double chi_square_max = 9.0;
  /// Steps of Gauss-Newton.
  int refine_count = 10;
  ConsensusOptions consensus;
};

struct SightingPose {
  Pose3d from_T_to;
  /// Of a small motion on the right of the pose, translation before rotation, metres and radians;
  /// as large as the errors are if these are larger than they should be.
  Matrix6d covariance = Matrix6d::Zero();
  /// Indices of the sightings that agree, ascending.
  std::vector<int> inliers;
  /// Mean squared error of these, in units of their covariance, by degrees of freedom: 1 is due.
  double chi_square_mean = 0.0;
};

/// The search for one pose. A sighting costs its squared error up to the gate, and more than that
/// up to 1 (Geman and McClure's cost), so that outliers cost alike. Both cameras must outlive it,
/// and have no distortion. Sightings have to be finite. Threads: const calls at once.
///
/// Source: Ke and Roumeliotis, "An efficient algebraic solution to the perspective-three-point
/// problem", CVPR 2017 (samples); Geman and McClure, 1987 (what a miss costs).
class SightingPoseSearch {
 public:
  SightingPoseSearch(const CameraCalibration& from, const CameraCalibration& to,
                     const SightingPoseOptions& options)
      : from_(from), to_(to), options_(options) {}

  /// The pose of least cost among samples of three and, if there is one, the guess, so that a good
  /// guess needs few samples and a bad one does no harm; nullopt if too few sightings agree with
  /// it. Samples are of sightings of one direction, that of which there are more. Cost: a hundredth
  /// of a millisecond a sample.
  std::optional<Pose3d> Consensus(std::span<const PointSighting> sightings,
                                  const std::optional<Pose3d>& guess, int* draw_count) const;

  /// Least squares of the sightings that agree; nullopt if they leave the pose open.
  std::optional<SightingPose> Refined(std::span<const PointSighting> sightings,
                                      const Pose3d& start) const;

  /// How many agree with a pose.
  int AgreeCount(std::span<const PointSighting> sightings, const Pose3d& from_T_to) const;

  /// Squared error in units of the covariance; infinite unless the point is before the camera.
  double ChiSquareOf(const PointSighting& sighting, const Pose3d& from_T_to,
                     const Pose3d& to_T_from) const;

 private:
  struct ScoredPose;
  struct PoseEquations;
  struct SightingError;

  SightingError ErrorOf(const PointSighting& sighting, const Pose3d& from_T_to,
                        const Pose3d& to_T_from) const;
  ScoredPose ScoreOf(std::span<const PointSighting> sightings, const Pose3d& from_T_to,
                     double limit = std::numeric_limits<double>::infinity()) const;
  PoseEquations EquationsAt(std::span<const PointSighting> sightings, const Pose3d& from_T_to,
                            bool is_robust) const;
  ScoredPose Improved(std::span<const PointSighting> sightings, ScoredPose pose) const;
  std::vector<Pose3d> PosesOfThree(std::span<const PointSighting> sightings,
                                   std::span<const size_t> three) const;

  const CameraCalibration& from_;
  const CameraCalibration& to_;
  const SightingPoseOptions options_;
};

}  // namespace dsg::ingest
