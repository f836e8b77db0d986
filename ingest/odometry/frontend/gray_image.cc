// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/gray_image_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// The patch around a place, minus its mean.
cv::Mat1f CentredPatch(const cv::Mat& image, const cv::Point2f& at, int reach) {
  const int side = 2 * reach + 1;
  cv::Mat1f patch;
  cv::getRectSubPix(image, {side, side}, at, patch, CV_32F);
  patch -= cv::mean(patch)[0];
  return patch;
}

}  // namespace

absl::Status BadInput(const CameraCalibration& camera, const std::string& field,
                      const std::string& is, const std::string& should) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(camera.name, ": the ", field, " is ", is, "; give ", should),
                   {{"field", absl::StrCat(camera.name, ".", field)}, {"value", is}});
}

std::string SizeText(int width, int height) { return absl::StrCat(width, " x ", height); }

absl::Status CheckGrayImage(const CameraCalibration& camera, const Image& image) {
  const bool fits = image.format == PixelFormat::kGray8 && image.width == camera.width &&
                    image.height == camera.height &&
                    image.bytes.size() == image.Offset(0, image.height);
  if (fits) return absl::OkStatus();
  return BadInput(
      camera, "image",
      absl::StrCat(SizeText(image.width, image.height), " ", std::string(Name(image.format)),
                   " of ", image.bytes.size(), " bytes"),
      absl::StrCat(SizeText(camera.width, camera.height), " gray8"));
}

cv::Mat1b GrayView(const Image& image) {
  return {image.height, image.width, const_cast<uint8_t*>(image.bytes.data())};
}

double CorrelationAt(const cv::Mat& a, const cv::Point2f& a_at, const cv::Mat& b,
                     const cv::Point2f& b_at, int reach) {
  const cv::Mat1f a_patch = CentredPatch(a, a_at, reach);
  const cv::Mat1f b_patch = CentredPatch(b, b_at, reach);
  const double scale = std::sqrt(a_patch.dot(a_patch) * b_patch.dot(b_patch));
  // What rounding leaves of a flat patch, in squared grey levels a pixel.
  constexpr double kFlat = 1e-4;
  return scale > kFlat * static_cast<double>(a_patch.total()) ? a_patch.dot(b_patch) / scale : 0.0;
}

}  // namespace dsg::ingest
