// SPDX-License-Identifier: Apache-2.0
// The images of a real camera pair, or of a camera with depth, as odometry wants them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/odometry/estimator/odometry.h"
#include "ingest/odometry/estimator/seen_features.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/rectify_lookup.h"

namespace dsg::ingest {

/// Images are decoded when they are needed: the second one at keyframes only.
using ImageLoad = std::function<absl::StatusOr<Image>()>;

/// Makes frames of images. The frames need it only while they are made.
class OdometryEye {
 public:
  virtual ~OdometryEye() = default;
  /// The rectified left camera, and the distance of the right one.
  virtual const StereoCamera& camera() const = 0;
  /// `left` is the image of the real left camera (or the one with colours), grey or RGB; `other`
  /// that of the right one, or of the depth camera.
  /// Errors: of loading `left`; INVALID_ARGUMENT/FIELD_INVALID when it does not fit its camera.
  virtual absl::StatusOr<OdometryFrame> FrameOf(TimeNs time_ns, const Image& left, ImageLoad other,
                                                std::vector<uint8_t> mask) const = 0;
  /// A mask for frames: where a label image shows one of the classes, ascending, or where the
  /// camera sees nothing. Empty if that is nowhere.
  virtual std::vector<uint8_t> MaskOf(const Image& labels,
                                      std::span<const int32_t> classes) const = 0;
};

/// Errors: of RectifiedPair::Make and StereoMatcher::Make.
absl::StatusOr<std::unique_ptr<OdometryEye>> MakeStereoEye(const CameraCalibration& left,
                                                           const CameraCalibration& right,
                                                           const StereoMatchOptions& options);

/// Depth along the optical axis is as good as a second camera 0.1 m to the right of the first one.
/// Errors: FIELD_INVALID unless both cameras have the same size, intrinsics and place: depth is
/// registered to the image.
absl::StatusOr<std::unique_ptr<OdometryEye>> MakeDepthEye(const CameraCalibration& camera,
                                                          const CameraCalibration& depth,
                                                          const StereoMatchOptions& options);

/// The luminance of an RGB image; a grey one as it is. Errors: FIELD_INVALID for other formats.
absl::StatusOr<Image> GrayOf(const Image& image);

}  // namespace dsg::ingest
