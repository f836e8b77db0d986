// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/stereo.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/depth/disparity_refinement_internal.h"
#include "ingest/sensor/rectified_pair.h"
#include "ingest/sensor/rectify_lookup.h"
#include "schema/base/status.h"

namespace dsg::ingest {

// Where a real camera's image shows what the rectified one sees, and where windows are inside it.
struct StereoLookup {
  RectifyLookup at;
  cv::Mat1b inside;
};

namespace {

// Of callers that give no range; dsg-ingest has an option for it.
constexpr double kRangeDefaultM = 5.0;
// OpenCV's matcher takes multiples of this many disparities: no option.
constexpr int kDisparitySteps = 16;
// Bytes hold the gradients in halves; Sobel's kernel gives eight of one: no option.
constexpr double kGradientScale = 2.0;

StereoLookup MakeLookup(const CameraCalibration& rectified, const CameraCalibration& real,
                        int border_px) {
  StereoLookup lookup{MakeRectifyLookup(rectified, real), {}};
  const cv::Mat1b inside(lookup.at.height, lookup.at.width, lookup.at.inside.data());
  // Windows across the border would match its straight line.
  const int side = 2 * border_px + 1;
  cv::erode(inside, lookup.inside, cv::Mat::ones(side, side, CV_8U), {-1, -1}, 1,
            cv::BORDER_CONSTANT, 0);
  return lookup;
}

cv::Mat1b Rectified(const Image& image, const StereoLookup& lookup) {
  const RectifyLookup& at = lookup.at;
  const cv::Mat1b real(image.height, image.width, const_cast<uint8_t*>(image.bytes.data()));
  const cv::Mat1f u(at.height, at.width, const_cast<float*>(at.u.data()));
  const cv::Mat1f v(at.height, at.width, const_cast<float*>(at.v.data()));
  cv::Mat1b rectified;
  cv::remap(real, rectified, u, v, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
  return rectified;
}

// 255 where there is enough to match.
cv::Mat1b Textured(const cv::Mat1b& image, const StereoOptions& options) {
  cv::Mat1s gradient;
  cv::Sobel(image, gradient, CV_16S, 1, 0);
  cv::Mat strength;
  cv::convertScaleAbs(gradient, strength, kGradientScale / 8.0);
  const int window = 2 * options.texture_reach_px + 1;
  cv::boxFilter(strength, strength, CV_32F, {window, window});
  cv::Mat1b textured;
  cv::compare(strength, options.texture_min * kGradientScale, textured, cv::CMP_GE);
  return textured;
}

int DisparityCount(const RectifiedPair& pair, double nearest_m) {
  const double largest = pair.left.fx * std::abs(pair.baseline_m) / nearest_m;
  const int count = kDisparitySteps * static_cast<int>(std::ceil(std::min(largest, 1e4) / 16.0));
  const int widest = (pair.left.width / 2 / kDisparitySteps) * kDisparitySteps;
  return std::max(kDisparitySteps, std::min(count, widest));
}

}  // namespace

class StereoDepth::Impl {
 public:
  Impl(const RectifiedPair& pair, const CameraCalibration& left, const CameraCalibration& right,
       double range_m, const StereoOptions& options)
      : pair_(pair),
        options_(options),
        range_m_(range_m > 0.0 ? range_m : kRangeDefaultM),
        left_lookup_(MakeLookup(pair.left, left, options.border_px)),
        right_lookup_(MakeLookup(pair.right, right, options.border_px)) {}

  const CameraCalibration& camera() const { return pair_.left; }

  std::vector<float> Compute(const Image& left, const Image& right) const {
    cv::Mat1b left_image = Rectified(left, left_lookup_);
    cv::Mat1b right_image = Rectified(right, right_lookup_);
    cv::Mat1b usable;
    cv::bitwise_and(Textured(left_image, options_), left_lookup_.inside, usable);
    cv::Mat1b right_inside = right_lookup_.inside;
    const bool is_mirrored = pair_.baseline_m < 0.0;
    if (is_mirrored) {
      cv::flip(left_image, left_image, 1);
      cv::flip(right_image, right_image, 1);
      cv::flip(right_lookup_.inside, right_inside, 1);
    }
    cv::Mat1f disparity = Match(left_image, right_image, right_inside);
    cv::Mat1f left_float;
    cv::Mat1f right_float;
    left_image.convertTo(left_float, CV_32F);
    right_image.convertTo(right_float, CV_32F);
    for (int i = 0; i < options_.refine.round_count; ++i) {
      RefineDisparity(left_float, right_float, options_.refine, &disparity);
    }
    if (is_mirrored) cv::flip(disparity, disparity, 1);
    return ToDepth(disparity, usable);
  }

 private:
  // Pixels, 0 where there is no match.
  cv::Mat1f Match(const cv::Mat1b& left, const cv::Mat1b& right,
                  const cv::Mat1b& right_inside) const {
    const int count = DisparityCount(pair_, options_.nearest_m);
    const int block = 2 * options_.block_reach_px + 1;
    const cv::Ptr<cv::StereoSGBM> matcher = cv::StereoSGBM::create(
        0, count, block, options_.step_penalty * block * block,
        options_.jump_penalty * block * block, /*disp12MaxDiff=*/options_.agree_px,
        /*preFilterCap=*/options_.gradient_max, /*uniquenessRatio=*/options_.unique_percent,
        /*speckleWindowSize=*/options_.speckle_px, /*speckleRange=*/options_.speckle_step_px,
        cv::StereoSGBM::MODE_SGBM_3WAY);
    // The matcher leaves out as many columns on the left as it tries disparities.
    cv::Mat left_wide;
    cv::Mat right_wide;
    cv::copyMakeBorder(left, left_wide, 0, 0, count, 0, cv::BORDER_REPLICATE);
    cv::copyMakeBorder(right, right_wide, 0, 0, count, 0, cv::BORDER_REPLICATE);
    cv::Mat wide;
    matcher->compute(left_wide, right_wide, wide);
    cv::Mat1f disparity;
    wide(cv::Rect(count, 0, left.cols, left.rows)).convertTo(disparity, CV_32F, 1.0 / 16.0);
    for (int v = 0; v < disparity.rows; ++v) {
      for (int u = 0; u < disparity.cols; ++u) {
        const int partner = u - static_cast<int>(std::lround(disparity(v, u)));
        const bool is_match =
            disparity(v, u) > 0.0f && partner >= 0 && right_inside(v, partner) != 0;
        if (!is_match) disparity(v, u) = 0.0f;
      }
    }
    return disparity;
  }

  std::vector<float> ToDepth(const cv::Mat1f& disparity, const cv::Mat1b& usable) const {
    const double scale = pair_.left.fx * std::abs(pair_.baseline_m);
    std::vector<float> depth_m(disparity.total(), 0.0f);
    size_t i = 0;
    for (int v = 0; v < disparity.rows; ++v) {
      for (int u = 0; u < disparity.cols; ++u, ++i) {
        if (disparity(v, u) <= 0.0f || usable(v, u) == 0) continue;
        const double metres = scale / disparity(v, u);
        if (metres <= range_m_) depth_m[i] = static_cast<float>(metres);
      }
    }
    return depth_m;
  }

  RectifiedPair pair_;
  StereoOptions options_;
  double range_m_;
  StereoLookup left_lookup_;
  StereoLookup right_lookup_;
};

StereoDepth::StereoDepth(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StereoDepth::~StereoDepth() = default;
StereoDepth::StereoDepth(StereoDepth&&) noexcept = default;
StereoDepth& StereoDepth::operator=(StereoDepth&&) noexcept = default;

absl::StatusOr<StereoDepth> StereoDepth::Make(const CameraCalibration& left,
                                              const CameraCalibration& right, double range_m,
                                              const StereoOptions& options) {
  DSG_ASSIGN_OR_RETURN(const RectifiedPair pair, RectifiedPair::Make(left, right));
  return StereoDepth(std::make_unique<Impl>(pair, left, right, range_m, options));
}

const CameraCalibration& StereoDepth::camera() const { return impl_->camera(); }

absl::StatusOr<std::vector<float>> StereoDepth::Compute(const Image& left,
                                                        const Image& right) const {
  const CameraCalibration& camera = impl_->camera();
  for (const Image* image : {&left, &right}) {
    if (image->format != PixelFormat::kGray8 || image->width != camera.width ||
        image->height != camera.height || image->bytes.size() != image->Offset(0, image->height)) {
      return MakeError(
          Reason::kFieldInvalid,
          absl::StrCat("the ", image == &left ? "left" : "right", " image of a stereo pair is ",
                       image->width, " x ", image->height, " ", std::string(Name(image->format)),
                       "; the calibration says ", camera.width, " x ", camera.height, " gray8"),
          {{"field", "resolution"}, {"value", absl::StrCat(image->width, "x", image->height)}});
    }
  }
  return impl_->Compute(left, right);
}

}  // namespace dsg::ingest
