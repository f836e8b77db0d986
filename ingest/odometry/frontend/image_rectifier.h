// SPDX-License-Identifier: Apache-2.0
// Grey images as a rectified camera would have taken them.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/rectify_lookup.h"

namespace dsg::ingest {

/// Threads: Apply may be called from several.
class ImageRectifier {
 public:
  /// As MakeRectifyLookup. Requires: both are valid.
  ImageRectifier(const CameraCalibration& rectified, const CameraCalibration& real);

  /// Linear interpolation; 0 where the real camera does not see. Cost: pixels.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID unless the image is grey and of the real camera's size.
  absl::StatusOr<Image> Apply(const Image& image) const;

  /// A mask for FeatureTracker: 1 where the real camera does not see, whose border would be taken
  /// for corners; empty if it sees all.
  const std::vector<uint8_t>& unseen() const { return unseen_; }

 private:
  CameraCalibration real_;
  RectifyLookup lookup_;
  std::vector<uint8_t> unseen_;
};

}  // namespace dsg::ingest
