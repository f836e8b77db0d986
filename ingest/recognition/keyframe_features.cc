// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/keyframe_features.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/stereo_match.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Of OpenCV's ORB: how far a descriptor reaches on its level, and how near to the border of it a
// corner may be. No options: the comparisons of a descriptor are made for them.
constexpr int kPatchPx = 31;
constexpr int kBorderPx = 19;

absl::Status UnfitInput(const CameraCalibration& camera, const std::string& field,
                        const std::string& is, const std::string& should) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(camera.name, ": the ", field, " is ", is, "; give ", should),
                   {{"field", absl::StrCat(camera.name, ".", field)}, {"value", is}});
}

absl::Status CheckInputs(const CameraCalibration& camera, const Image& image,
                         std::span<const uint8_t> mask) {
  const bool fits = image.format == PixelFormat::kGray8 && image.width == camera.width &&
                    image.height == camera.height &&
                    image.bytes.size() == image.Offset(0, image.height);
  if (!fits) {
    return UnfitInput(
        camera, "image",
        absl::StrCat(image.width, " x ", image.height, " ", std::string(Name(image.format)), " of ",
                     image.bytes.size(), " bytes"),
        absl::StrCat(camera.width, " x ", camera.height, " gray8"));
  }
  if (!mask.empty() && mask.size() != image.bytes.size()) {
    return UnfitInput(camera, "mask", absl::StrCat(mask.size(), " bytes"),
                      absl::StrCat(image.bytes.size(), ", one for each pixel, or none"));
  }
  return absl::OkStatus();
}

// Where corners may be found, as OpenCV wants it; empty = everywhere.
cv::Mat1b AllowedPixels(const CameraCalibration& camera, std::span<const uint8_t> mask,
                        int growth_px) {
  if (mask.empty()) return {};
  const cv::Mat1b view(camera.height, camera.width, const_cast<uint8_t*>(mask.data()));
  const int side = 2 * growth_px + 1;
  cv::Mat1b grown;
  cv::dilate(view, grown, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  cv::Mat1b allowed;
  cv::compare(grown, 0, allowed, cv::CMP_EQ);
  return allowed;
}

// The strongest corners, of which no cell has too many.
std::vector<cv::KeyPoint> SpreadCorners(std::vector<cv::KeyPoint> corners, const cv::Size& size,
                                        const KeyframeFeatureOptions& options) {
  std::sort(corners.begin(), corners.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    return std::tuple(-a.response, a.octave, a.pt.y, a.pt.x) <
           std::tuple(-b.response, b.octave, b.pt.y, b.pt.x);
  });
  const int columns = (size.width + options.cell_px - 1) / options.cell_px;
  const int rows = (size.height + options.cell_px - 1) / options.cell_px;
  const double share = static_cast<double>(options.feature_count_max) / (columns * rows);
  const int cap = std::max(1, static_cast<int>(std::lround(options.cell_share_max * share)));
  std::vector<int> counts(static_cast<size_t>(columns) * static_cast<size_t>(rows), 0);
  std::vector<cv::KeyPoint> kept;
  for (const cv::KeyPoint& corner : corners) {
    if (std::ssize(kept) >= options.feature_count_max) break;
    const int column = std::clamp(static_cast<int>(corner.pt.x) / options.cell_px, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(corner.pt.y) / options.cell_px, 0, rows - 1);
    const int cell = row * columns + column;
    int& count = counts[static_cast<size_t>(cell)];
    if (count >= cap) continue;
    ++count;
    kept.push_back(corner);
  }
  return kept;
}

// Of a depth image; 0 where unknown, or where neighbours say something else.
float SteadyDepth(const CameraCalibration& camera, const DepthLookup& depth,
                  const Eigen::Vector2f& pixel, const KeyframeFeatureOptions& options) {
  const int column = static_cast<int>(std::lround(pixel.x()));
  const int row = static_cast<int>(std::lround(pixel.y()));
  const int reach = options.depth_edge_px;
  const bool is_inside = column >= reach && row >= reach && column + reach < camera.width &&
                         row + reach < camera.height;
  if (!is_inside) return 0.0f;
  const float here = depth(column, row);
  if (!(here > 0.0f && here <= kDepthMaxM)) return 0.0f;
  for (const auto& [right, down] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
    const float beside = depth(column + right * reach, row + down * reach);
    if (!(std::abs(beside - here) <= options.depth_edge_share * here)) return 0.0f;
  }
  return here;
}

}  // namespace

Eigen::Vector3d KeyframeFeatures::BearingOf(size_t i) const {
  return PinholeRay(camera, features[i].pixel.x(), features[i].pixel.y()).normalized();
}

std::optional<StereoPoint> KeyframeFeatures::PointOf(size_t i) const {
  const KeyframeFeature& feature = features[i];
  if (!(feature.depth_m > 0.0f)) return std::nullopt;
  const Eigen::Vector3d ray = PinholeRay(camera, feature.pixel.x(), feature.pixel.y());
  const double aside = double{feature.depth_m} * feature.pixel_sigma_px;
  StereoPoint result;
  result.point = double{feature.depth_m} * ray;
  result.covariance = double{feature.depth_sigma_m} * feature.depth_sigma_m * ray * ray.transpose();
  result.covariance(0, 0) += aside * aside / (camera.fx * camera.fx);
  result.covariance(1, 1) += aside * aside / (camera.fy * camera.fy);
  return result;
}

class KeyframeFeatureFinder::Impl {
 public:
  Impl(CameraCalibration camera, const KeyframeFeatureOptions& options)
      : camera_(std::move(camera)), options_(options) {}

  void UseStereo(const RectifiedPair& pair, StereoMatcher matcher) {
    scale_ = pair.left.fx * std::abs(pair.baseline_m);
    matcher_.emplace(std::move(matcher));
  }

  absl::StatusOr<KeyframeFeatures> Find(const KeyframeStamp& stamp, const Image& image,
                                        std::span<const uint8_t> mask) const {
    DSG_RETURN_IF_ERROR(CheckInputs(camera_, image, mask));
    const cv::Mat1b view(image.height, image.width, const_cast<uint8_t*>(image.bytes.data()));
    const auto scale = static_cast<float>(options_.level_scale);
    const cv::Ptr<cv::ORB> orb =
        cv::ORB::create(options_.feature_count_max * options_.candidate_ratio, scale,
                        options_.level_count, kBorderPx, /*firstLevel=*/0, /*WTA_K=*/2,
                        cv::ORB::HARRIS_SCORE, kPatchPx, options_.corner_contrast);
    std::vector<cv::KeyPoint> corners;
    orb->detect(view, corners, AllowedPixels(camera_, mask, options_.mask_growth_px));
    corners = SpreadCorners(std::move(corners), view.size(), options_);
    cv::Mat descriptors;
    // Drops corners whose descriptor would reach beyond the image.
    if (!corners.empty()) orb->compute(view, corners, descriptors);
    return Kept(stamp, corners, descriptors);
  }

  absl::StatusOr<KeyframeFeatures> FindInPair(const KeyframeStamp& stamp, const Image& left,
                                              const Image& right,
                                              std::span<const uint8_t> mask) const {
    DSG_CHECK(matcher_.has_value());
    absl::StatusOr<KeyframeFeatures> found = Find(stamp, left, mask);
    if (!found.ok()) return found;
    std::vector<Eigen::Vector2d> pixels;
    for (const KeyframeFeature& feature : found->features) {
      pixels.push_back(feature.pixel.cast<double>());
    }
    DSG_ASSIGN_OR_RETURN(const std::vector<StereoMatch> matches,
                         matcher_->Match(left, right, pixels));
    for (size_t i = 0; i < matches.size(); ++i) {
      if (matches[i].outcome != StereoOutcome::kMatched) continue;
      const double depth_m = scale_ / matches[i].disparity_px;
      const double sigma_m = depth_m * options_.disparity_sigma_px / matches[i].disparity_px;
      found->features[i].depth_m = static_cast<float>(depth_m);
      found->features[i].depth_sigma_m = static_cast<float>(sigma_m);
    }
    return found;
  }

  absl::StatusOr<KeyframeFeatures> FindWithDepth(const KeyframeStamp& stamp, const Image& image,
                                                 const DepthLookup& depth,
                                                 std::span<const uint8_t> mask) const {
    absl::StatusOr<KeyframeFeatures> found = Find(stamp, image, mask);
    if (!found.ok()) return found;
    for (KeyframeFeature& feature : found->features) {
      feature.depth_m = SteadyDepth(camera_, depth, feature.pixel, options_);
      if (feature.depth_m == 0.0f) continue;
      const double square_m2 = double{feature.depth_m} * feature.depth_m;
      feature.depth_sigma_m =
          static_cast<float>(options_.depth_sigma_m + options_.depth_sigma_per_m2 * square_m2);
    }
    return found;
  }

 private:
  KeyframeFeatures Kept(const KeyframeStamp& stamp, const std::vector<cv::KeyPoint>& corners,
                        const cv::Mat& descriptors) const {
    KeyframeFeatures kept{stamp, camera_, {}, {}};
    kept.features.reserve(corners.size());
    kept.descriptors.resize(corners.size());
    for (size_t i = 0; i < corners.size(); ++i) {
      const double sigma_px =
          options_.pixel_sigma_px * std::pow(options_.level_scale, corners[i].octave);
      kept.features.push_back(
          {{corners[i].pt.x, corners[i].pt.y}, static_cast<float>(sigma_px), 0.0f, 0.0f});
      std::memcpy(kept.descriptors[i].data(), descriptors.ptr(static_cast<int>(i)),
                  sizeof(OrbDescriptor));
    }
    return kept;
  }

  CameraCalibration camera_;
  KeyframeFeatureOptions options_;
  std::optional<StereoMatcher> matcher_;
  // Depth times disparity.
  double scale_ = 0.0;
};

KeyframeFeatureFinder::KeyframeFeatureFinder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
KeyframeFeatureFinder::~KeyframeFeatureFinder() = default;
KeyframeFeatureFinder::KeyframeFeatureFinder(KeyframeFeatureFinder&&) noexcept = default;
KeyframeFeatureFinder& KeyframeFeatureFinder::operator=(KeyframeFeatureFinder&&) noexcept = default;

absl::StatusOr<KeyframeFeatureFinder> KeyframeFeatureFinder::Make(
    const CameraCalibration& camera, const KeyframeFeatureOptions& options) {
  DSG_RETURN_IF_ERROR(camera.Validate());
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  if (camera.distortion != Distortion::kNone) {
    return UnfitInput(camera, "distortion", "not none", "images of a rectified camera");
  }
  return KeyframeFeatureFinder(std::make_unique<Impl>(camera, options));
}

absl::StatusOr<KeyframeFeatureFinder> KeyframeFeatureFinder::MakeStereo(
    const RectifiedPair& pair, const KeyframeFeatureOptions& options,
    const StereoMatchOptions& stereo_options) {
  DSG_ASSIGN_OR_RETURN(KeyframeFeatureFinder finder, Make(pair.left, options));
  DSG_ASSIGN_OR_RETURN(StereoMatcher matcher, StereoMatcher::Make(pair, stereo_options));
  finder.impl_->UseStereo(pair, std::move(matcher));
  return finder;
}

absl::StatusOr<KeyframeFeatures> KeyframeFeatureFinder::Find(const KeyframeStamp& stamp,
                                                             const Image& image,
                                                             std::span<const uint8_t> mask) const {
  return impl_->Find(stamp, image, mask);
}

absl::StatusOr<KeyframeFeatures> KeyframeFeatureFinder::FindInPair(
    const KeyframeStamp& stamp, const Image& left, const Image& right,
    std::span<const uint8_t> mask) const {
  return impl_->FindInPair(stamp, left, right, mask);
}

absl::StatusOr<KeyframeFeatures> KeyframeFeatureFinder::FindWithDepth(
    const KeyframeStamp& stamp, const Image& image, const DepthLookup& depth,
    std::span<const uint8_t> mask) const {
  return impl_->FindWithDepth(stamp, image, depth, mask);
}

}  // namespace dsg::ingest
