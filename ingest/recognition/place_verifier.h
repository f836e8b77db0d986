// SPDX-License-Identifier: Apache-2.0
// Whether two keyframes that look alike are of one place, and where they stood to each other.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "absl/status/statusor.h"
#include "ingest/recognition/keyframe_features.h"
#include "ingest/recognition/recognition_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

enum class PlaceOutcome {
  kVerified,
  /// It is the same place; without any depth nobody knows how far apart both stood.
  kDirectionOnly,
  /// Too few features look alike, or too few of these have a depth where some have.
  kTooFewMatches,
  /// No pose has enough matches that agree.
  kDisagree,
  /// Too few agree in the end, or they are all in one corner of an image.
  kTooFewInliers,
  kClustered,
  /// What agrees leaves the pose open, or both stood too far apart.
  kLoose,
  kTooFar,
};
/// "verified", "direction only", ...
std::string_view Name(PlaceOutcome outcome);

struct PlaceVerdict {
  PlaceOutcome outcome = PlaceOutcome::kTooFewMatches;
  /// kVerified: the body of `to` in that of `from`, metres.
  Pose3d from_T_to;
  /// kVerified: inverse covariance of a small motion on the right of from_T_to, translation before
  /// rotation, metres and radians, as loop closures have it; with the floors of the options.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  /// The camera of `to` in that of `from`: as far as it is known, also of what is refused. Metres;
  /// kDirectionOnly: of length 1, or 0 if only a turn is seen.
  Pose3d camera_from_T_to;
  /// Features that look alike, those of them with a depth in either keyframe, those of these that
  /// agree with the pose in the end, and all matches that do, among which are those found by the
  /// pose. Without any depth all that agree are of the first kind.
  int match_count = 0;
  int point_count = 0;
  int agree_count = 0;
  int inlier_count = 0;
  /// Mean squared error of these, in units of their covariance, by degrees of freedom: 1 is due.
  double chi_square_mean = 0.0;
  int draw_count = 0;
};

/// Matches of descriptors; a pose by samples of three points that one camera knows and the other
/// one sees; matches near to where that pose says; least squares of all that agree, with both
/// depths of a match where both are known. Where neither keyframe has any depth: five-point
/// samples.
///
/// Either keyframe may be without depth, and each has its own camera. The same keyframes and
/// options give the same verdict; counts bound it, never clocks. Threads: all calls may come from
/// several.
/// Cost for 1000 features each on one busy core: 7 ms of matching, and 8 ms of samples and
/// refinement; without depths 50 ms of samples.
class PlaceVerifier {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for options out of their ranges.
  static absl::StatusOr<PlaceVerifier> Make(const PlaceVerifierOptions& options = {});

  PlaceVerdict Verify(const KeyframeFeatures& from, const KeyframeFeatures& to) const;

 private:
  explicit PlaceVerifier(const PlaceVerifierOptions& options) : options_(options) {}

  PlaceVerifierOptions options_;
};

}  // namespace dsg::ingest
