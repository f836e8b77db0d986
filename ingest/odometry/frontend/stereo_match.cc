// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/stereo_match.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/gray_image_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Disparities beside the best one belong to its peak: no option.
constexpr int kPeakReach = 2;
// Searched beyond what the options allow, so that a peak at a bound is seen to be one, pixels.
constexpr int kBeyond = 2;
// Of the refinement: it has converged by then.
constexpr int kRefineSteps = 30;
constexpr double kRefineStepPx = 0.01;

// A left patch with mean 0 and length 1.
struct Template {
  std::vector<float> values;
  // Standard deviation, grey levels.
  double contrast = 0.0;
};

Template TemplateAt(const cv::Mat1b& image, const cv::Point2f& at, int reach) {
  const int side = 2 * reach + 1;
  cv::Mat1f patch;
  cv::getRectSubPix(image, {side, side}, at, patch, CV_32F);
  patch -= cv::mean(patch)[0];
  const double length = std::sqrt(patch.dot(patch));
  Template result;
  result.contrast = length / side;
  if (length > 0.0) patch /= length;
  result.values.assign(patch.begin(), patch.end());
  return result;
}

// Correlations of a patch with those around all whole pixels along a part of a row. The innermost
// loops run along the row, which vectors do; at each pixel terms are added in the patch's order.
class RowCorrelation {
 public:
  RowCorrelation(const Template& sought, int reach) : sought_(sought), reach_(reach) {}

  // At (first_x, y) and the pixels on its right, `count` altogether; -1 where the image is flat.
  // Requires: the patches are inside. Holds until the next call.
  std::span<const float> At(const cv::Mat1b& image, int first_x, int y, int count) {
    const int side = 2 * reach_ + 1;
    product_.assign(static_cast<size_t>(count), 0.0f);
    sums_.assign(static_cast<size_t>(count + side - 1), 0);
    sums2_ = sums_;
    pixels_.resize(sums_.size());
    const float* value = sought_.values.data();
    for (int row = y - reach_; row <= y + reach_; ++row, value += side) {
      Take(image.ptr<uint8_t>(row) + (first_x - reach_));
      for (int i = 0; i < side; ++i) AddProducts(value[i], i);
    }
    for (int x = 0; x < count; ++x) Normalise(x, side);
    return product_;
  }

 private:
  void Take(const uint8_t* row) {
    const auto width = static_cast<int>(pixels_.size());
    for (int i = 0; i < width; ++i) pixels_[static_cast<size_t>(i)] = row[i];
    for (int i = 0; i < width; ++i) sums_[static_cast<size_t>(i)] += row[i];
    for (int i = 0; i < width; ++i) sums2_[static_cast<size_t>(i)] += row[i] * row[i];
  }

  void AddProducts(float value, int offset) {
    const float* pixels = pixels_.data() + offset;
    float* product = product_.data();
    const size_t count = product_.size();
    for (size_t x = 0; x < count; ++x) product[x] += value * pixels[x];
  }

  void Normalise(int x, int side) {
    const double sum = std::accumulate(sums_.begin() + x, sums_.begin() + x + side, 0);
    const double sum2 = std::accumulate(sums2_.begin() + x, sums2_.begin() + x + side, 0);
    const double spread2 = sum2 - sum * sum / (side * side);
    float& product = product_[static_cast<size_t>(x)];
    product = spread2 > 0.5 ? product / static_cast<float>(std::sqrt(spread2)) : -1.0f;
  }

  const Template& sought_;
  const int reach_;
  std::vector<float> product_;
  // Of the rows of a patch: each column's sum, and that of squares; one row's pixels.
  std::vector<int> sums_;
  std::vector<int> sums2_;
  std::vector<float> pixels_;
};

// The best disparity, in whole pixels.
struct Peak {
  cv::Point at;
  float correlation = -1.0f;
  // Of the best other peak.
  float second = -1.0f;
};

}  // namespace

class StereoMatcher::Impl {
 public:
  Impl(const RectifiedPair& pair, const StereoMatchOptions& options)
      : pair_(pair), options_(options) {
    const double scale = pair.left.fx * std::abs(pair.baseline_m);
    side_ = pair.baseline_m > 0.0 ? -1 : 1;
    disparity_min_ = scale / options.farthest_m;
    disparity_max_ = std::min<double>(scale / options.nearest_m, pair.left.width);
  }

  absl::StatusOr<std::vector<StereoMatch>> Match(const Image& left, const Image& right,
                                                 std::span<const Eigen::Vector2d> pixels) const {
    DSG_RETURN_IF_ERROR(CheckGrayImage(pair_.left, left));
    DSG_RETURN_IF_ERROR(CheckGrayImage(pair_.right, right));
    const cv::Mat1b left_view = GrayView(left);
    const cv::Mat1b right_view = GrayView(right);
    std::vector<StereoMatch> matches(pixels.size());
    Seeds seeds;
    for (size_t i = 0; i < pixels.size(); ++i) {
      const std::optional<cv::Point> at = Seed(left_view, right_view, pixels[i], &matches[i]);
      if (!at.has_value()) continue;
      seeds.index.push_back(i);
      seeds.left.push_back(PointOf(pixels[i]));
      seeds.right.emplace_back(*at);
    }
    Refine(left_view, right_view, seeds, &matches);
    return matches;
  }

 private:
  // Matches that are to be refined.
  struct Seeds {
    std::vector<size_t> index;
    std::vector<cv::Point2f> left;
    std::vector<cv::Point2f> right;
  };

  static cv::Point2f PointOf(const Eigen::Vector2d& pixel) {
    return {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
  }

  // Whether patches around a place are inside, also after rounding.
  bool IsInside(double x, double y) const {
    const double margin = options_.patch_reach_px + 0.5;
    return x >= margin && y >= margin && x <= pair_.left.width - 1 - margin &&
           y <= pair_.left.height - 1 - margin;
  }

  // Where to refine a match, if there is one.
  std::optional<cv::Point> Seed(const cv::Mat1b& left, const cv::Mat1b& right,
                                const Eigen::Vector2d& pixel, StereoMatch* match) const {
    // Also of what is no number.
    if (!IsInside(pixel.x(), pixel.y())) {
      match->outcome = StereoOutcome::kAtBorder;
      return std::nullopt;
    }
    const Template sought = TemplateAt(left, PointOf(pixel), options_.patch_reach_px);
    if (sought.contrast < options_.contrast_min) {
      match->outcome = StereoOutcome::kFlat;
      return std::nullopt;
    }
    const Peak peak = PeakOf(sought, right, pixel);
    if (peak.correlation <= 0.0f) return std::nullopt;
    TakePlace(pixel, peak.at, peak.correlation, match);
    if (peak.correlation - peak.second < options_.distinct_min) {
      match->outcome = StereoOutcome::kAmbiguous;
      return std::nullopt;
    }
    return peak.at;
  }

  void TakePlace(const Eigen::Vector2d& pixel, const cv::Point2f& at, double correlation,
                 StereoMatch* match) const {
    match->disparity_px = side_ * (at.x - pixel.x());
    match->row_offset_px = at.y - pixel.y();
    match->correlation = correlation;
  }

  // The best place of each disparity, on the row or beside it; the best of these, and the next
  // peak.
  Peak PeakOf(const Template& sought, const cv::Mat1b& right, const Eigen::Vector2d& pixel) const {
    const int reach = options_.patch_reach_px;
    const int rows = static_cast<int>(options_.row_px_max);
    const int x0 = cvRound(pixel.x());
    const int y0 = cvRound(pixel.y());
    const int first = static_cast<int>(std::floor(std::min(disparity_min_, 0.0))) - kBeyond;
    const int last = static_cast<int>(std::ceil(disparity_max_)) + kBeyond;
    std::vector<Peak> curve(static_cast<size_t>(last - first + 1));
    // Places whose patches are inside.
    const int from_x = std::max(std::min(x0 + side_ * first, x0 + side_ * last), reach);
    const int to_x =
        std::min(std::max(x0 + side_ * first, x0 + side_ * last), right.cols - 1 - reach);
    RowCorrelation along(sought, reach);
    for (int y = std::max(y0 - rows, reach);
         from_x <= to_x && y <= std::min(y0 + rows, right.rows - 1 - reach); ++y) {
      int x = from_x;
      for (const float correlation : along.At(right, from_x, y, to_x - from_x + 1)) {
        Peak& best = curve[static_cast<size_t>(side_ * (x - x0) - first)];
        if (correlation > best.correlation) best = {{x, y}, correlation};
        ++x;
      }
    }
    return BestOf(curve);
  }

  static Peak BestOf(const std::vector<Peak>& curve) {
    const auto best = std::max_element(
        curve.begin(), curve.end(),
        [](const Peak& a, const Peak& b) { return a.correlation < b.correlation; });
    Peak peak = *best;
    for (auto other = curve.begin(); other != curve.end(); ++other) {
      const bool is_peak =
          (other == curve.begin() || other->correlation > (other - 1)->correlation) &&
          (other + 1 == curve.end() || other->correlation >= (other + 1)->correlation);
      if (is_peak && std::abs(other - best) > kPeakReach) {
        peak.second = std::max(peak.second, other->correlation);
      }
    }
    return peak;
  }

  void Refine(const cv::Mat1b& left, const cv::Mat1b& right, const Seeds& seeds,
              std::vector<StereoMatch>* matches) const {
    if (seeds.index.empty()) return;
    const int side = 2 * options_.patch_reach_px + 1;
    const cv::TermCriteria end(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kRefineSteps,
                               kRefineStepPx);
    std::vector<cv::Point2f> found = seeds.right;
    std::vector<uint8_t> is_found;
    cv::calcOpticalFlowPyrLK(left, right, seeds.left, found, is_found, cv::noArray(), {side, side},
                             /*maxLevel=*/0, end, cv::OPTFLOW_USE_INITIAL_FLOW);
    for (size_t i = 0; i < seeds.index.size(); ++i) {
      StereoMatch& match = (*matches)[seeds.index[i]];
      const cv::Point2f off = found[i] - seeds.right[i];
      // One that runs away from its peak follows something else.
      if (is_found[i] == 0 || !(std::hypot(off.x, off.y) <= options_.refine_px_max)) continue;
      TakePlace({seeds.left[i].x, seeds.left[i].y}, found[i],
                CorrelationAt(left, seeds.left[i], right, found[i], options_.patch_reach_px),
                &match);
      match.outcome = Judged(match);
    }
  }

  StereoOutcome Judged(const StereoMatch& match) const {
    if (match.correlation < options_.correlation_min) return StereoOutcome::kUnlike;
    if (std::abs(match.row_offset_px) > options_.row_px_max) return StereoOutcome::kOffRow;
    const bool is_in_range =
        match.disparity_px >= disparity_min_ && match.disparity_px <= disparity_max_;
    return is_in_range ? StereoOutcome::kMatched : StereoOutcome::kOutOfRange;
  }

  RectifiedPair pair_;
  StereoMatchOptions options_;
  // Columns in the right image for a pixel of disparity: -1 if its camera stands on the right.
  int side_ = -1;
  double disparity_min_ = 0.0;
  double disparity_max_ = 0.0;
};

StereoMatcher::StereoMatcher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StereoMatcher::~StereoMatcher() = default;
StereoMatcher::StereoMatcher(StereoMatcher&&) noexcept = default;
StereoMatcher& StereoMatcher::operator=(StereoMatcher&&) noexcept = default;

absl::StatusOr<StereoMatcher> StereoMatcher::Make(const RectifiedPair& pair,
                                                  const StereoMatchOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  if (options.nearest_m >= options.farthest_m) {
    return BadInput(pair.left, "nearest distance of stereo features",
                    absl::StrCat(options.nearest_m, " m"),
                    absl::StrCat("less than the farthest, ", options.farthest_m, " m"));
  }
  return StereoMatcher(std::make_unique<Impl>(pair, options));
}

absl::StatusOr<std::vector<StereoMatch>> StereoMatcher::Match(
    const Image& left, const Image& right, std::span<const Eigen::Vector2d> pixels) const {
  return impl_->Match(left, right, pixels);
}

}  // namespace dsg::ingest
