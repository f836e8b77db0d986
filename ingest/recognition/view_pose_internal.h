// SPDX-License-Identifier: Apache-2.0
// Where two cameras stood to each other, from matched features of which many may be wrong and some
// have a depth.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ingest/recognition/descriptor_match_internal.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// What one match says of a pose: one camera knows a point, which is seen by the other one.
///
/// The error is in pixels of that other camera, and in its inverse depth if it knows one too (there
/// errors of stereo are normal). Its covariance is that of both sightings and of the point's depth,
/// which moves the projection along a line.
struct PointSighting {
  FeatureMatch match;
  /// The camera `from` knows the point; else `to` does.
  bool is_forward = true;
  /// In the frame of the camera that knows it, and by how much one standard deviation of its depth
  /// moves it.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d depth_step = Eigen::Vector3d::Zero();
  /// Standard deviation of the point across its ray, metres.
  double aside_sigma_m = 0.0;
  /// Where the other camera sees it.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double pixel_sigma_px = 1.0;
  /// 1 / metres; a standard deviation of 0 is of no depth.
  double inverse_depth = 0.0;
  double inverse_sigma = 0.0;
};

struct ViewPose {
  /// The camera `to` in the frame of the camera `from`, metres.
  Pose3d from_T_to;
  /// Of a small motion on the right of the pose, translation before rotation, metres and radians;
  /// as large as the errors are if these are larger than they should be.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Matches that agree.
  std::vector<FeatureMatch> inliers;
  /// Mean squared error of these, in units of their covariance, by degrees of freedom: 1 is due.
  double chi_square_mean = 0.0;
};

/// The search for one pose between two keyframes; these, BitsOfAllPairs of them and the options
/// must outlive it.
///
/// Source: Ke and Roumeliotis, "An efficient algebraic solution to the perspective-three-point
/// problem", CVPR 2017 (samples); Geman and McClure, 1987 (what a miss costs).
class ViewPoseSearch {
 public:
  ViewPoseSearch(const KeyframeFeatures& from, const KeyframeFeatures& to, const cv::Mat1i& bits,
                 const PlaceVerifierOptions& options)
      : from_(from), to_(to), bits_(bits), options_(options) {}

  /// Of matches of which at least one feature has a depth, in their order.
  std::vector<PointSighting> SightingsOf(const std::vector<FeatureMatch>& matches) const;

  /// The pose of least cost among samples of three, refined; nullopt if too few agree with it.
  std::optional<Pose3d> Consensus(const std::vector<PointSighting>& sightings,
                                  int* draw_count) const;

  /// All features with a depth, matched with what is near to where `from_T_to` says. Each feature
  /// at most once.
  std::vector<FeatureMatch> MatchesNear(const Pose3d& from_T_to) const;

  /// How many agree with a pose.
  int AgreeCount(const std::vector<PointSighting>& sightings, const Pose3d& from_T_to) const;

  /// Least squares of the sightings that agree; nullopt if they leave the pose open.
  std::optional<ViewPose> Refined(const std::vector<PointSighting>& sightings,
                                  const Pose3d& start) const;

 private:
  struct ScoredPose;
  struct PoseEquations;
  struct SightingError;

  SightingError ErrorOf(const PointSighting& sighting, const Pose3d& from_T_to,
                        const Pose3d& to_T_from) const;
  ScoredPose ScoreOf(const std::vector<PointSighting>& sightings, const Pose3d& from_T_to,
                     double limit) const;
  PoseEquations EquationsAt(const std::vector<PointSighting>& sightings, const Pose3d& from_T_to,
                            bool is_robust) const;
  ScoredPose Improved(const std::vector<PointSighting>& sightings, ScoredPose pose) const;
  std::vector<Pose3d> PosesOfThree(const std::vector<PointSighting>& sightings,
                                   const std::vector<size_t>& three) const;
  PointSighting SightingOf(const FeatureMatch& match, bool is_forward) const;

  const KeyframeFeatures& from_;
  const KeyframeFeatures& to_;
  const cv::Mat1i& bits_;
  const PlaceVerifierOptions& options_;
};

}  // namespace dsg::ingest
