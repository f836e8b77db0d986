// SPDX-License-Identifier: Apache-2.0
// Corners of one camera's images, found at keyframes and followed from image to image.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

struct Feature {
  /// Ascending in the order of detection, from 0; never used again.
  int64_t id = 0;
  /// In the last image; pixel centres are at whole numbers.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  /// Images that it was followed into.
  int image_count = 0;
  /// Calls of Detect since it was detected.
  int keyframe_count = 0;
};

/// What has become of the features of the image before.
struct TrackCounts {
  int tracked = 0;
  /// Out of the image, or where the rotation takes them behind the camera.
  int left = 0;
  /// Not found, or what is there does not look the same.
  int lost = 0;
  /// New ones that do not come back to where they were.
  int strayed = 0;
  /// Beneath the mask.
  int masked = 0;
  /// On an older one.
  int merged = 0;
};

/// Pyramidal Lucas-Kanade (OpenCV's) on Shi-Tomasi corners. If the turn of the camera is known,
/// features are sought in images without their local mean, and in the last one as it would have
/// looked from there: windows that are not turned, and those under a lens that darkens the borders,
/// lag behind. The same images give the same features, whatever the number of threads.
///
/// A mask has a byte for each pixel of the camera, not 0 where nothing may be followed (what
/// moves), or is empty. It is grown by `mask_growth_px`.
///
/// Memory: two images and pyramids, and what the options allow of features.
/// Threads: one caller at a time.
/// Source: Shi and Tomasi, 1994; Bouguet, 2000; Hwangbo, Kim and Kanade, 2009 (start from a
/// rotation).
class FeatureTracker {
 public:
  /// `camera` is that of the images, without distortion: they are rectified.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a camera that is not valid, has distortion, or is
  /// too small for a feature; of options out of their ranges.
  static absl::StatusOr<FeatureTracker> Make(const CameraCalibration& camera,
                                             const FeatureTrackerOptions& options = {});
  ~FeatureTracker();
  FeatureTracker(FeatureTracker&&) noexcept;
  FeatureTracker& operator=(FeatureTracker&&) noexcept;

  /// Follows all features into the next image. `last_R_now` (unit) is the orientation of the camera
  /// in its frame at the image before, as a gyroscope tells it: where the search begins. Unset:
  /// nobody knows.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID when image or mask do not fit the camera, or the
  /// rotation is not finite; the features stay those of the image before.
  absl::StatusOr<TrackCounts> Track(
      const Image& image, const std::optional<Eigen::Quaterniond>& last_R_now = std::nullopt,
      std::span<const uint8_t> mask = {});

  /// At a keyframe: drops features that are too old, then finds new ones in cells of the last image
  /// that have none. Count of new ones; 0 before the first image.
  /// Errors: as above, of the mask.
  absl::StatusOr<int> Detect(std::span<const uint8_t> mask = {});

  /// Drops features that others have found to be wrong; unknown ids are nothing.
  void Drop(std::span<const int64_t> ids);
  /// Undoes the last Track, and what came after it: features are those of the image before, which
  /// the next one is compared with. So an image that shows nothing (a hand before the lens) costs
  /// no features. Once after each Track; nothing happens before the second image.
  void GoBack();
  /// Forgets the last image and all features; ids go on.
  void Reset();

  /// Of the last image, ascending by id.
  const std::vector<Feature>& features() const;

 private:
  class Impl;
  explicit FeatureTracker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
