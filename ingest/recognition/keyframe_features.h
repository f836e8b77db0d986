// SPDX-License-Identifier: Apache-2.0
// What recognition keeps of a keyframe: where its corners are, what they look like, and how far
// away they are where stereo or a depth image tells it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/frontend/stereo_pose.h"
#include "ingest/recognition/recognition_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/rectified_pair.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// 256 comparisons of grey levels around a corner, turned with it; Hamming distance tells how alike
/// two corners are.
using OrbDescriptor = std::array<uint8_t, 32>;

struct KeyframeFeature {
  /// Pixel centres are at whole numbers.
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  /// Standard deviation of the place, pixels: grows with the level of the image that it was found
  /// on.
  float pixel_sigma_px = 1.0f;
  /// Along the optical axis, metres, and its standard deviation; 0 = unknown.
  float depth_m = 0.0f;
  float depth_sigma_m = 0.0f;
};

/// Which keyframe it is.
struct KeyframeStamp {
  /// A path that one clock and one odometry belong to: a robot in a session. Callers count them.
  int track = 0;
  TimeNs time_ns = 0;
};

/// 56 bytes a corner.
struct KeyframeFeatures {
  KeyframeStamp stamp;
  /// The (left) camera, without distortion.
  CameraCalibration camera;
  /// As many as features, in their order: the strongest corners first.
  std::vector<OrbDescriptor> descriptors;
  std::vector<KeyframeFeature> features;

  /// Towards a feature, frame of the camera, unit.
  Eigen::Vector3d BearingOf(size_t i) const;
  /// Where it is in the frame of the camera, metres; nullopt without a depth.
  std::optional<StereoPoint> PointOf(size_t i) const;
};

/// Metres along the optical axis at a pixel of the camera, inside of it; 0 or less where unknown.
using DepthLookup = std::function<float(int column, int row)>;

/// OpenCV's ORB, spread over the image: each cell has its share of the corners.
///
/// A mask is as in FeatureTracker: a byte for each pixel of the camera, not 0 where nothing may be
/// found (what moves, what the real camera does not see), or empty.
///
/// Threads: all calls may come from several. The same images give the same features.
/// Cost: 10 ms for 640 x 480 pixels; 15 ms for stereo of 1000 corners, less with a
/// StereoMatchOptions::row_px_max below 1, which looks along one row.
/// Source: Rublee, Rabaud, Konolige and Bradski, "ORB: an efficient alternative to SIFT or SURF",
/// ICCV 2011.
class KeyframeFeatureFinder {
 public:
  /// Of one camera, without distortion.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a camera that is not valid or has distortion; of
  /// options out of their ranges.
  static absl::StatusOr<KeyframeFeatureFinder> Make(const CameraCalibration& camera,
                                                    const KeyframeFeatureOptions& options = {});
  /// Of the left camera of a pair. Errors: also those of StereoMatcher::Make.
  static absl::StatusOr<KeyframeFeatureFinder> MakeStereo(
      const RectifiedPair& pair, const KeyframeFeatureOptions& options = {},
      const StereoMatchOptions& stereo_options = {});
  ~KeyframeFeatureFinder();
  KeyframeFeatureFinder(KeyframeFeatureFinder&&) noexcept;
  KeyframeFeatureFinder& operator=(KeyframeFeatureFinder&&) noexcept;

  /// Features without depth.
  /// Errors of all: INVALID_ARGUMENT/FIELD_INVALID when an image or mask does not fit the camera.
  absl::StatusOr<KeyframeFeatures> Find(const KeyframeStamp& stamp, const Image& image,
                                        std::span<const uint8_t> mask = {}) const;
  /// With the depths of those that stereo matches. Both images are rectified (ImageRectifier).
  /// Requires: made by MakeStereo.
  absl::StatusOr<KeyframeFeatures> FindInPair(const KeyframeStamp& stamp, const Image& left,
                                              const Image& right,
                                              std::span<const uint8_t> mask = {}) const;
  /// With the depths that `depth` tells, but for those at an edge of depth.
  absl::StatusOr<KeyframeFeatures> FindWithDepth(const KeyframeStamp& stamp, const Image& image,
                                                 const DepthLookup& depth,
                                                 std::span<const uint8_t> mask = {}) const;

 private:
  class Impl;
  explicit KeyframeFeatureFinder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
