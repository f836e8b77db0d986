// SPDX-License-Identifier: Apache-2.0
// Grey images as OpenCV sees them: whether they fit their camera, and how much patches look alike.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "absl/status/status.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// Of something that does not fit a camera: "cam0: the `field` is `is`; give `should`".
absl::Status BadInput(const CameraCalibration& camera, const std::string& field,
                      const std::string& is, const std::string& should);
/// "752 x 480".
std::string SizeText(int width, int height);
/// Errors: INVALID_ARGUMENT/FIELD_INVALID unless the image is grey and of the camera's size.
absl::Status CheckGrayImage(const CameraCalibration& camera, const Image& image);

/// The image itself, without a copy; it must outlive what is returned, which is not written to.
/// Requires: CheckGrayImage.
cv::Mat1b GrayView(const Image& image);

/// Normalised correlation of the patches of (2 * reach + 1)^2 pixels around two places, between
/// pixels by linear interpolation, beyond the border the border's: -1 to 1, whatever brightness and
/// contrast; 0 where one is flat.
double CorrelationAt(const cv::Mat& a, const cv::Point2f& a_at, const cv::Mat& b,
                     const cv::Point2f& b_at, int reach);

}  // namespace dsg::ingest
