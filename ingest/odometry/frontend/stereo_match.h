// SPDX-License-Identifier: Apache-2.0
// Where features of a rectified left image are in the right one: along the row, and only where it
// is clear.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/rectified_pair.h"

namespace dsg::ingest {

enum class StereoOutcome {
  kMatched,
  /// The patch around the feature is not all inside the left image.
  kAtBorder,
  /// The patch has no contrast.
  kFlat,
  /// Nothing in the right image looks like it.
  kUnlike,
  /// Two places do: a pattern that repeats.
  kAmbiguous,
  /// What looks most like it is too far off the row: a wrong calibration, or chance.
  kOffRow,
  /// ... nearer or farther than the options allow.
  kOutOfRange,
};

/// All but the outcome is that of the best place, and 0 where there was none to look at.
struct StereoMatch {
  StereoOutcome outcome = StereoOutcome::kUnlike;
  /// Columns from the right image's place to the left one's; minus that if the right camera stands
  /// on the left. Positive before the cameras.
  double disparity_px = 0.0;
  /// Rows from the left image's place to the right one's.
  double row_offset_px = 0.0;
  /// -1 to 1.
  double correlation = 0.0;
};

/// Normalised correlation of a patch at every disparity within range, then Lucas-Kanade (OpenCV's)
/// from the best one for fractions of a pixel.
///
/// Threads: Match may be called from several. Cost: pixels of a patch times disparities a feature.
class StereoMatcher {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for options out of their ranges.
  static absl::StatusOr<StereoMatcher> Make(const RectifiedPair& pair,
                                            const StereoMatchOptions& options = {});
  ~StereoMatcher();
  StereoMatcher(StereoMatcher&&) noexcept;
  StereoMatcher& operator=(StereoMatcher&&) noexcept;

  /// One match for each pixel of the left image, in their order. Both images are rectified
  /// (ImageRectifier).
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID unless both are grey and of the cameras' size.
  absl::StatusOr<std::vector<StereoMatch>> Match(const Image& left, const Image& right,
                                                 std::span<const Eigen::Vector2d> pixels) const;

 private:
  class Impl;
  explicit StereoMatcher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
