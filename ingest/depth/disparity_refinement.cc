// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/disparity_refinement_internal.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace dsg::ingest {
namespace {

cv::Mat1f WindowMean(const cv::Mat1f& image, int reach_px) {
  cv::Mat1f mean;
  cv::boxFilter(image, mean, -1, {2 * reach_px + 1, 2 * reach_px + 1});
  return mean;
}

// Gradient along the rows, grey levels a pixel.
cv::Mat1f RowGradient(const cv::Mat1f& image) {
  cv::Mat1f gradient;
  cv::Sobel(image, gradient, CV_32F, 1, 0, 1, 0.5);
  return gradient;
}

struct Warped {
  cv::Mat1f gray;
  /// Gradient along the rows.
  cv::Mat1f slope;
};

// The right image as the left camera would see it, if the disparities were right.
Warped Warp(const cv::Mat1f& right, const cv::Mat1f& disparity) {
  cv::Mat1f column(disparity.size());
  cv::Mat1f row(disparity.size());
  for (int v = 0; v < column.rows; ++v) {
    for (int u = 0; u < column.cols; ++u) {
      column(v, u) = static_cast<float>(u) - disparity(v, u);
      row(v, u) = static_cast<float>(v);
    }
  }
  Warped warped;
  cv::remap(right, warped.gray, column, row, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::remap(RowGradient(right), warped.slope, column, row, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return warped;
}

}  // namespace

void RefineDisparity(const cv::Mat1f& left, const cv::Mat1f& right, const RefineOptions& options,
                     cv::Mat1f* disparity) {
  const auto slope_min = static_cast<float>(options.slope_min);
  const auto step_max = static_cast<float>(options.step_px_max);
  Warped warped = Warp(right, *disparity);
  cv::Mat1f matched;
  cv::threshold(*disparity, matched, 0.0, 1.0, cv::THRESH_BINARY);
  const cv::Mat1f count = WindowMean(matched, options.reach_px);
  cv::Mat1f difference;
  cv::subtract(left, warped.gray, difference);
  cv::multiply(difference, matched, difference);
  const cv::Mat1f mean = WindowMean(difference, options.reach_px);
  for (int v = 0; v < count.rows; ++v) {
    for (int u = 0; u < count.cols; ++u) {
      // The two cameras' exposures may differ.
      const float bias = count(v, u) > 0.0f ? mean(v, u) / count(v, u) : 0.0f;
      float& slope = warped.slope(v, u);
      difference(v, u) = (difference(v, u) - bias) * slope * matched(v, u);
      slope *= slope * matched(v, u);
    }
  }
  const cv::Mat1f top = WindowMean(difference, options.reach_px);
  const cv::Mat1f bottom = WindowMean(warped.slope, options.reach_px);
  for (int v = 0; v < count.rows; ++v) {
    for (int u = 0; u < count.cols; ++u) {
      if (matched(v, u) == 0.0f || bottom(v, u) < slope_min) continue;
      const float step = -top(v, u) / bottom(v, u);
      if (std::abs(step) < step_max) (*disparity)(v, u) += step;
    }
  }
}

}  // namespace dsg::ingest
