// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_verifier.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "ingest/odometry/frontend/relative_pose.h"
#include "ingest/recognition/view_sightings_internal.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

using PoseMatrix = Eigen::Matrix<double, 6, 6>;

constexpr double kRadiansOfDegree = M_PI / 180.0;

// A small motion on the right of a pose of b, as one on the right of a pose of a.
PoseMatrix MotionFromTo(const Pose3d& a_T_b) {
  const Eigen::Matrix3d turn = a_T_b.orientation.toRotationMatrix();
  PoseMatrix adjoint;
  adjoint << turn, CrossMatrix(a_T_b.position) * turn, Eigen::Matrix3d::Zero(), turn;
  return adjoint;
}

// Standard deviation along the axis that is known worst.
double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().z()));
}

// Of 8 x 6 parts of an image, how many hold a feature.
class PartCounter {
 public:
  explicit PartCounter(const CameraCalibration& camera) : camera_(camera) {}

  void Take(const Eigen::Vector2f& pixel) {
    const int column = static_cast<int>(kColumns * pixel.x() / static_cast<float>(camera_.width));
    const int row = static_cast<int>(kRows * pixel.y() / static_cast<float>(camera_.height));
    const int part = std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1);
    is_taken_[static_cast<size_t>(part)] = true;
  }
  int count() const {
    return static_cast<int>(std::count(is_taken_.begin(), is_taken_.end(), true));
  }

 private:
  static constexpr int kColumns = 8;
  static constexpr int kRows = 6;

  const CameraCalibration& camera_;
  std::array<bool, static_cast<size_t>(kColumns)* kRows> is_taken_ = {};
};

int FewestParts(const KeyframeFeatures& from, const KeyframeFeatures& to,
                const std::vector<FeatureMatch>& matches) {
  PartCounter from_parts(from.camera);
  PartCounter to_parts(to.camera);
  for (const FeatureMatch& match : matches) {
    from_parts.Take(from.features[static_cast<size_t>(match.from)].pixel);
    to_parts.Take(to.features[static_cast<size_t>(match.to)].pixel);
  }
  return std::min(from_parts.count(), to_parts.count());
}

std::vector<FeatureMatch> MatchesAt(const std::vector<FeatureMatch>& matches,
                                    const std::vector<int>& indices) {
  std::vector<FeatureMatch> chosen;
  chosen.reserve(indices.size());
  for (const int i : indices) chosen.push_back(matches[static_cast<size_t>(i)]);
  return chosen;
}

// Of a pose that was found, whether it is believed.
PlaceOutcome JudgedPose(const KeyframeFeatures& from, const KeyframeFeatures& to,
                        const SightingPose& pose, const std::vector<FeatureMatch>& inliers,
                        const PlaceVerifierOptions& options) {
  if (std::ssize(inliers) < options.inlier_count_min) return PlaceOutcome::kTooFewInliers;
  if (FewestParts(from, to, inliers) < options.part_count_min) {
    return PlaceOutcome::kClustered;
  }
  const bool is_loose =
      LargestSigma(pose.covariance.topLeftCorner<3, 3>()) > options.position_sigma_max_m ||
      LargestSigma(pose.covariance.bottomRightCorner<3, 3>()) >
          options.turn_sigma_max_deg * kRadiansOfDegree;
  if (is_loose) return PlaceOutcome::kLoose;
  const bool is_far = pose.from_T_to.position.norm() > options.distance_m_max;
  return is_far ? PlaceOutcome::kTooFar : PlaceOutcome::kVerified;
}

// The pose of the bodies, with floors.
void TakeBodyPose(const Pose3d& from_body_T_camera, const Pose3d& to_body_T_camera,
                  const SightingPose& pose, const PlaceVerifierOptions& options,
                  PlaceVerdict* verdict) {
  verdict->from_T_to = from_body_T_camera * pose.from_T_to * to_body_T_camera.Inverse();
  verdict->from_T_to.orientation.normalize();
  const PoseMatrix moved = MotionFromTo(to_body_T_camera);
  PoseMatrix covariance = moved * pose.covariance * moved.transpose();
  const double turn_floor = options.turn_floor_deg * kRadiansOfDegree;
  covariance.diagonal().head<3>().array() += options.position_floor_m * options.position_floor_m;
  covariance.diagonal().tail<3>().array() += turn_floor * turn_floor;
  const PoseMatrix information = covariance.inverse();
  verdict->information = 0.5 * (information + information.transpose());
}

// Of matches of which some have a depth.
void VerifyPoints(const KeyframeFeatures& from, const KeyframeFeatures& to, const cv::Mat1i& bits,
                  const ViewSightings& view, const PlaceVerifierOptions& options,
                  PlaceVerdict* verdict) {
  const SightingPoseSearch search(
      from.camera, to.camera, {options.chi_square_max, options.refine_count, options.consensus});
  verdict->outcome = PlaceOutcome::kDisagree;
  const std::optional<Pose3d> first =
      search.Consensus(view.sightings, std::nullopt, &verdict->draw_count);
  if (!first.has_value()) return;
  verdict->camera_from_T_to = *first;
  const ViewSightings near =
      SightingsOf(from, to, MatchesNear(from, to, bits, search, *first, options));
  const std::optional<SightingPose> pose = search.Refined(near.sightings, *first);
  verdict->outcome = PlaceOutcome::kLoose;
  if (!pose.has_value()) return;
  verdict->camera_from_T_to = pose->from_T_to;
  verdict->inlier_count = static_cast<int>(pose->inliers.size());
  verdict->chi_square_mean = pose->chi_square_mean;
  verdict->agree_count = search.AgreeCount(view.sightings, pose->from_T_to);
  // What was found by a pose agrees with it, also with a wrong one; what was found before tells.
  if (verdict->agree_count < options.agree_count_min ||
      verdict->agree_count < options.agree_share_min * verdict->point_count) {
    verdict->outcome = PlaceOutcome::kTooFewInliers;
    return;
  }
  verdict->outcome = JudgedPose(from, to, *pose, MatchesAt(near.matches, pose->inliers), options);
  if (verdict->outcome != PlaceOutcome::kVerified) return;
  TakeBodyPose(from.camera.body_T_camera, to.camera.body_T_camera, *pose, options, verdict);
}

bool HasDepth(const KeyframeFeatures& keyframe) {
  return std::any_of(keyframe.features.begin(), keyframe.features.end(),
                     [](const KeyframeFeature& feature) { return feature.depth_m > 0.0f; });
}

// Of matches of two cameras that know no depth.
void VerifyBearings(const KeyframeFeatures& from, const KeyframeFeatures& to,
                    const std::vector<FeatureMatch>& matches, const PlaceVerifierOptions& options,
                    PlaceVerdict* verdict) {
  std::vector<BearingPair> pairs;
  pairs.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    pairs.push_back({from.BearingOf(static_cast<size_t>(match.from)),
                     to.BearingOf(static_cast<size_t>(match.to))});
  }
  RelativePoseOptions mono;
  mono.consensus = options.consensus;
  mono.consensus.draw_count_max = options.mono_draw_count_max;
  mono.inlier_px = options.mono_inlier_px;
  // As RelativePoseOptions has it: misses of half of this size cost half of what an outlier does.
  mono.soft_px = 0.5 * options.mono_inlier_px;
  mono.refine_count = options.refine_count;
  const MonoPose pose = FivePointPose(pairs, std::min(from.camera.fx, to.camera.fx), mono);
  verdict->draw_count = pose.draw_count;
  verdict->outcome = PlaceOutcome::kDisagree;
  if (pose.outcome != PoseOutcome::kFound && pose.outcome != PoseOutcome::kNoTranslation) return;
  verdict->camera_from_T_to = pose.first_T_second;
  verdict->agree_count = verdict->inlier_count = static_cast<int>(pose.inliers.size());
  const std::vector<FeatureMatch> inliers = MatchesAt(matches, pose.inliers);
  const double share = static_cast<double>(inliers.size()) / static_cast<double>(matches.size());
  if (verdict->inlier_count < options.mono_inlier_count_min ||
      share < options.mono_inlier_share_min) {
    verdict->outcome = PlaceOutcome::kTooFewInliers;
  } else if (FewestParts(from, to, inliers) < options.part_count_min) {
    verdict->outcome = PlaceOutcome::kClustered;
  } else {
    verdict->outcome = PlaceOutcome::kDirectionOnly;
  }
}

}  // namespace

std::string_view Name(PlaceOutcome outcome) {
  switch (outcome) {
    case PlaceOutcome::kVerified:
      return "verified";
    case PlaceOutcome::kDirectionOnly:
      return "direction only";
    case PlaceOutcome::kTooFewMatches:
      return "too few matches";
    case PlaceOutcome::kDisagree:
      return "matches disagree";
    case PlaceOutcome::kTooFewInliers:
      return "too few agree";
    case PlaceOutcome::kClustered:
      return "clustered";
    case PlaceOutcome::kLoose:
      return "loose";
    case PlaceOutcome::kTooFar:
      return "too far";
  }
  return "unknown";
}

absl::StatusOr<PlaceVerifier> PlaceVerifier::Make(const PlaceVerifierOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  return PlaceVerifier(options);
}

PlaceVerdict PlaceVerifier::Verify(const KeyframeFeatures& from, const KeyframeFeatures& to) const {
  PlaceVerdict verdict;
  const cv::Mat1i bits = BitsOfAllPairs(from, to);
  const std::vector<FeatureMatch> matches = MutualMatches(bits, options_);
  const ViewSightings view = SightingsOf(from, to, matches);
  verdict.match_count = static_cast<int>(matches.size());
  verdict.point_count = static_cast<int>(view.sightings.size());
  if (verdict.match_count < options_.match_count_min) return verdict;
  if (verdict.point_count >= options_.match_count_min) {
    VerifyPoints(from, to, bits, view, options_, &verdict);
  } else if (!HasDepth(from) && !HasDepth(to)) {
    VerifyBearings(from, to, matches, options_, &verdict);
  }
  return verdict;
}

}  // namespace dsg::ingest
