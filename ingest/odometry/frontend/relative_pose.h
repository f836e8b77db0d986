// SPDX-License-Identifier: Apache-2.0
// The motion of one camera between two images, from matched bearings of which many may be wrong,
// and which of them are right. Scale is unknown: the translation is a direction.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Directions to one point of the world in the frames of both cameras; unit.
struct BearingPair {
  Eigen::Vector3d first;
  Eigen::Vector3d second;
};

enum class PoseOutcome {
  kFound,
  /// The points that agree show a rotation only, or none: standstill, pure rotation, or a way that
  /// is short against the distance of what is seen.
  kNoTranslation,
  /// Fewer points than the smallest sample.
  kTooFewPoints,
  /// No motion has enough points that agree.
  kNoConsensus,
};

struct MonoPose {
  PoseOutcome outcome = PoseOutcome::kTooFewPoints;
  /// The second camera in the frame of the first; the position has length 1, or 0 unless kFound.
  /// Identity without a motion.
  Pose3d first_T_second;
  /// Another motion that explains the points as well: the points of one plane allow five-point two.
  /// The inliers are right in either case.
  std::optional<Pose3d> twin_first_T_second;
  /// Indices of pairs that agree, ascending.
  std::vector<int> inliers;
  /// Median flow of the inliers once the rotation is taken off, pixels. Five-point: the rotation
  /// that explains most points without a translation.
  double parallax_px = 0.0;
  /// Samples that were drawn.
  int draw_count = 0;
};

/// "5pt", "2pt".
enum class MonoPoseMethod { kFivePoint, kTwoPoint };
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for another name.
absl::StatusOr<MonoPoseMethod> ParseMonoPoseMethod(std::string_view name);

/// Rotation and direction from samples of five pairs, which OpenCV solves. A motion is scored by
/// the angle by which both bearings of a pair together miss a point before both cameras, and
/// refined on the pairs that agree. The angle between translation and epipolar plane is no such
/// measure: it grows without bound as parallax shrinks. Bearings with z <= 0 or that are not finite
/// never agree.
///
/// `focal_px`: pixels of a radian, which turns pixels of the options into angles; > 0.
/// Cost: a fraction of a millisecond a sample; 167 samples for 50 % outliers, 2178 for 70 %.
/// Source: Nister, 2004 (five points); Geman and McClure, 1987 (what a miss costs); Chum, Matas and
/// Kittler, 2003 (refinement inside the search).
MonoPose FivePointPose(std::span<const BearingPair> pairs, double focal_px,
                       const RelativePoseOptions& options = {});

/// The direction alone from samples of two pairs; the rotation is that of a gyroscope, unit. 19
/// samples for 50 % outliers, 57 for 70 %.
/// Source: Kneip, Chli and Siegwart, 2011 (two points).
MonoPose TwoPointPose(std::span<const BearingPair> pairs, const Eigen::Quaterniond& first_R_second,
                      double focal_px, const RelativePoseOptions& options = {});

}  // namespace dsg::ingest
