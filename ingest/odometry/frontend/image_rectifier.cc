// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/image_rectifier.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "ingest/odometry/frontend/gray_image_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {

ImageRectifier::ImageRectifier(const CameraCalibration& rectified, const CameraCalibration& real)
    : real_(real), lookup_(MakeRectifyLookup(rectified, real)) {
  for (const uint8_t inside : lookup_.inside) unseen_.push_back(inside == 0 ? 1 : 0);
  if (std::find(unseen_.begin(), unseen_.end(), 1) == unseen_.end()) unseen_.clear();
}

absl::StatusOr<Image> ImageRectifier::Apply(const Image& image) const {
  DSG_RETURN_IF_ERROR(CheckGrayImage(real_, image));
  const cv::Mat1f u(lookup_.height, lookup_.width, const_cast<float*>(lookup_.u.data()));
  const cv::Mat1f v(lookup_.height, lookup_.width, const_cast<float*>(lookup_.v.data()));
  Image rectified{lookup_.width, lookup_.height, PixelFormat::kGray8, {}};
  rectified.bytes.resize(rectified.Offset(0, rectified.height));
  cv::Mat1b pixels(rectified.height, rectified.width, rectified.bytes.data());
  // Of the size and type of the result, so that it writes into it.
  cv::remap(GrayView(image), pixels, u, v, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
  return rectified;
}

}  // namespace dsg::ingest
