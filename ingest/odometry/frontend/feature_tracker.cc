// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/feature_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/gray_image_internal.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status CheckMask(const CameraCalibration& camera, std::span<const uint8_t> mask) {
  const size_t pixels = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
  if (mask.empty() || mask.size() == pixels) return absl::OkStatus();
  return BadInput(camera, "mask", absl::StrCat(mask.size(), " bytes"),
                  absl::StrCat(pixels, ", one for each pixel, or none"));
}

// Not 0 where nothing may be followed; empty if it may be everywhere.
cv::Mat1b GrownMask(const CameraCalibration& camera, std::span<const uint8_t> mask, int growth) {
  if (mask.empty()) return {};
  const cv::Mat1b given(camera.height, camera.width, const_cast<uint8_t*>(mask.data()));
  cv::Mat1b grown;
  const int side = 2 * growth + 1;
  cv::dilate(given, grown, cv::Mat::ones(side, side, CV_8U));
  return grown;
}

bool IsIn(const cv::Mat1b& mask, const cv::Point2f& at) {
  return !mask.empty() && mask(cvRound(at.y), cvRound(at.x)) != 0;
}

// A corner of an image, with OpenCV's measure of it.
struct Corner {
  float strength = 0.0f;
  cv::Point at;
};

// cv::cornerMinEigenVal of bytes is 4 / 255^2 times the mean squared gradient along the weaker
// direction.
double StrengthOf(double gradient) { return 4.0 / (255.0 * 255.0) * gradient * gradient; }

// The strongest corner of each cell that has none of the features, strongest first.
std::vector<Corner> CornersOf(const cv::Mat& image, const cv::Mat1b& mask,
                              const std::vector<Feature>& features,
                              const FeatureTrackerOptions& options) {
  cv::Mat1f strength;
  cv::cornerMinEigenVal(image, strength, 2 * options.corner_reach_px + 1);
  cv::Mat1f around;
  cv::dilate(strength, around, cv::Mat());
  double strongest = 0.0;
  cv::minMaxLoc(strength, nullptr, &strongest);
  const double least = std::max(StrengthOf(options.corner_gradient_min),
                                strongest * options.corner_share_min * options.corner_share_min);
  const int columns = (image.cols + options.cell_px - 1) / options.cell_px;
  const int rows = (image.rows + options.cell_px - 1) / options.cell_px;
  const auto cell_of = [&](int x, int y) {
    return static_cast<size_t>(y / options.cell_px * columns + x / options.cell_px);
  };
  std::vector<Corner> best(static_cast<size_t>(columns * rows));
  std::vector<bool> is_taken(best.size(), false);
  for (const Feature& feature : features) {
    is_taken[cell_of(cvRound(feature.pixel.x()), cvRound(feature.pixel.y()))] = true;
  }
  for (int y = options.border_px; y < image.rows - options.border_px; ++y) {
    for (int x = options.border_px; x < image.cols - options.border_px; ++x) {
      const float here = strength(y, x);
      // Only peaks: the slope of a neighbour cell's corner is none.
      if (here < least || here <= 0.0f || here < around(y, x)) continue;
      const size_t cell = cell_of(x, y);
      if (is_taken[cell] || here <= best[cell].strength) continue;
      if (!mask.empty() && mask(y, x) != 0) continue;
      best[cell] = {here, {x, y}};
    }
  }
  std::erase_if(best, [](const Corner& corner) { return corner.strength <= 0.0f; });
  std::stable_sort(best.begin(), best.end(),
                   [](const Corner& a, const Corner& b) { return a.strength > b.strength; });
  return best;
}

cv::Point2f PointOf(const Feature& feature) {
  return {static_cast<float>(feature.pixel.x()), static_cast<float>(feature.pixel.y())};
}

bool IsNear(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double distance) {
  return (a - b).squaredNorm() < distance * distance;
}

}  // namespace

class FeatureTracker::Impl {
 public:
  Impl(const CameraCalibration& camera, const FeatureTrackerOptions& options)
      : camera_(camera), options_(options) {}

  absl::StatusOr<TrackCounts> Track(const Image& image,
                                    const std::optional<Eigen::Quaterniond>& last_R_now,
                                    std::span<const uint8_t> mask) {
    DSG_RETURN_IF_ERROR(CheckGrayImage(camera_, image));
    DSG_RETURN_IF_ERROR(CheckMask(camera_, mask));
    if (last_R_now.has_value() && !last_R_now->coeffs().allFinite()) {
      return BadInput(camera_, "rotation", "not finite", "a unit quaternion");
    }
    const cv::Mat now = GrayView(image).clone();
    features_before_ = features_;
    TrackCounts counts;
    if (!features_.empty()) {
      Follow(now, last_R_now, &counts);
      const cv::Mat1b grown = GrownMask(camera_, mask, options_.mask_growth_px);
      counts.masked = DropIf([&](const Feature& feature) { return IsIn(grown, PointOf(feature)); });
      counts.merged = Merge();
    }
    counts.tracked = static_cast<int>(features_.size());
    image_before_ = std::exchange(image_, now);
    return counts;
  }

  absl::StatusOr<int> Detect(std::span<const uint8_t> mask) {
    DSG_RETURN_IF_ERROR(CheckMask(camera_, mask));
    if (image_.empty()) return 0;
    for (Feature& feature : features_) ++feature.keyframe_count;
    DropIf([&](const Feature& feature) {
      return feature.keyframe_count > options_.keyframe_count_max;
    });
    const cv::Mat1b grown = GrownMask(camera_, mask, options_.mask_growth_px);
    int new_count = 0;
    for (const Corner& corner : CornersOf(image_, grown, features_, options_)) {
      if (std::ssize(features_) >= options_.feature_count_max) break;
      const Eigen::Vector2d pixel(corner.at.x, corner.at.y);
      const bool is_crowded =
          std::any_of(features_.begin(), features_.end(), [&](const Feature& feature) {
            return IsNear(feature.pixel, pixel, options_.apart_px_min);
          });
      if (is_crowded) continue;
      features_.push_back({.id = next_id_++, .pixel = pixel});
      ++new_count;
    }
    return new_count;
  }

  void Drop(std::span<const int64_t> ids) {
    DropIf([&](const Feature& feature) {
      return std::find(ids.begin(), ids.end(), feature.id) != ids.end();
    });
  }

  void GoBack() {
    if (image_before_.empty()) return;
    image_ = std::exchange(image_before_, cv::Mat());
    features_ = std::exchange(features_before_, {});
  }

  void Reset() {
    features_.clear();
    image_ = image_before_ = cv::Mat();
  }

  const std::vector<Feature>& features() const { return features_; }

 private:
  // A feature on its way into the next image, and where it is in the image before, as turned.
  struct Step {
    Feature feature;
    cv::Point2f before;
    cv::Point2f after;
  };

  // A turn of a pixel or more.
  static constexpr double kTurnPx = 1.0;

  cv::Size Window() const {
    const int side = 2 * options_.window_reach_px + 1;
    return {side, side};
  }

  // Without what varies slowly: a lens darkens the borders of all images alike, which holds windows
  // without much else in them back where they were.
  cv::Mat Flat(const cv::Mat& image) const {
    const int side = 2 * options_.flat_reach_px + 1;
    cv::Mat mean;
    cv::blur(image, mean, cv::Size(side, side));
    cv::Mat flat;
    cv::addWeighted(image, 1.0, mean, -1.0, 128.0, flat);
    return flat;
  }

  std::vector<cv::Mat> PyramidOf(const cv::Mat& image) const {
    std::vector<cv::Mat> pyramid;
    cv::buildOpticalFlowPyramid(image, pyramid, Window(), options_.level_count - 1,
                                /*withDerivatives=*/true, cv::BORDER_REFLECT_101,
                                cv::BORDER_CONSTANT, /*tryReuseInputImage=*/false);
    return pyramid;
  }

  template <typename Predicate>
  int DropIf(const Predicate& predicate) {
    return static_cast<int>(std::erase_if(features_, predicate));
  }

  bool IsInside(const cv::Point2f& at) const {
    return at.x >= 0.0f && at.y >= 0.0f && at.x <= static_cast<float>(camera_.width - 1) &&
           at.y <= static_cast<float>(camera_.height - 1);
  }

  // The last image as the camera would have taken it with the attitude of the next one: a window
  // that turns with the image looks the same there. Where a turn stretches windows, which it does
  // by some per cent near the borders, features would lag behind.
  cv::Mat TurnedImage(const Eigen::Matrix3d& now_R_last) const {
    Eigen::Matrix3d camera;
    camera << camera_.fx, 0.0, camera_.cx, 0.0, camera_.fy, camera_.cy, 0.0, 0.0, 1.0;
    const Eigen::Matrix3d by_turn = camera * now_R_last * camera.inverse();
    cv::Matx33d homography;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) homography(row, column) = by_turn(row, column);
    }
    cv::Mat turned;
    cv::warpPerspective(image_, turned, homography, image_.size(), cv::INTER_LINEAR,
                        cv::BORDER_REPLICATE);
    return turned;
  }

  // Where features are in the next image if the camera turns only; outside where it turns away.
  std::vector<cv::Point2f> Turned(const Eigen::Matrix3d& now_R_last) const {
    std::vector<cv::Point2f> points;
    for (const Feature& feature : features_) {
      const Eigen::Vector3d turned =
          now_R_last * PinholeRay(camera_, feature.pixel.x(), feature.pixel.y());
      // Numbers that OpenCV can make pixels of.
      const Eigen::Vector2d pixel =
          turned.z() > 0.01 ? Project(camera_, turned) : Eigen::Vector2d(-1.0, -1.0);
      points.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
    return points;
  }

  // Sets `points` to where `from` are in the image `to`, which begin as guesses; 0 where not found.
  std::vector<uint8_t> Search(const std::vector<cv::Mat>& from_pyramid,
                              const std::vector<cv::Mat>& to_pyramid,
                              const std::vector<cv::Point2f>& from,
                              std::vector<cv::Point2f>* points) const {
    std::vector<uint8_t> is_found;
    const cv::TermCriteria end(cv::TermCriteria::COUNT + cv::TermCriteria::EPS,
                               options_.step_count_max, options_.step_px_min);
    cv::calcOpticalFlowPyrLK(from_pyramid, to_pyramid, from, *points, is_found, cv::noArray(),
                             Window(), options_.level_count - 1, end, cv::OPTFLOW_USE_INITIAL_FLOW);
    return is_found;
  }

  // Where the turn is not known, features are sought far away, on the levels of small images: what
  // varies slowly is all that those have.
  void Follow(const cv::Mat& image, const std::optional<Eigen::Quaterniond>& last_R_now,
              TrackCounts* counts) {
    const Eigen::Quaterniond turn = last_R_now.value_or(Eigen::Quaterniond::Identity());
    const bool is_turned =
        camera_.fx * AngleBetween(turn, Eigen::Quaterniond::Identity()) >= kTurnPx;
    const Eigen::Matrix3d now_R_last =
        is_turned ? turn.conjugate().toRotationMatrix() : Eigen::Matrix3d::Identity();
    const cv::Mat last = is_turned ? TurnedImage(now_R_last) : image_;
    const bool is_flat = last_R_now.has_value() && options_.flat_reach_px > 0;
    const std::vector<cv::Mat> before = PyramidOf(is_flat ? Flat(last) : last);
    const std::vector<cv::Mat> pyramid = PyramidOf(is_flat ? Flat(image) : image);
    const std::vector<cv::Point2f> from = Turned(now_R_last);
    std::vector<Step> steps;
    for (size_t i = 0; i < features_.size(); ++i) {
      if (IsInside(from[i])) {
        steps.push_back({features_[i], from[i], from[i]});
      } else {
        ++counts->left;
      }
    }
    SearchAhead(before, pyramid, &steps, counts);
    counts->strayed = DropStrayed(before, pyramid, &steps);
    features_.clear();
    for (Step& step : steps) {
      step.feature.pixel = {step.after.x, step.after.y};
      ++step.feature.image_count;
      features_.push_back(step.feature);
    }
  }

  void SearchAhead(const std::vector<cv::Mat>& pyramid_before, const std::vector<cv::Mat>& pyramid,
                   std::vector<Step>* steps, TrackCounts* counts) const {
    if (steps->empty()) return;
    std::vector<cv::Point2f> before;
    for (const Step& step : *steps) before.push_back(step.before);
    std::vector<cv::Point2f> after = before;
    const std::vector<uint8_t> is_found = Search(pyramid_before, pyramid, before, &after);
    std::vector<Step> kept;
    for (size_t i = 0; i < steps->size(); ++i) {
      if (is_found[i] != 0 && !IsInside(after[i])) {
        ++counts->left;
      } else if (is_found[i] == 0 ||
                 !LooksTheSame(pyramid_before[0], before[i], pyramid[0], after[i])) {
        ++counts->lost;
      } else {
        kept.push_back((*steps)[i]);
        kept.back().after = after[i];
      }
    }
    *steps = std::move(kept);
  }

  // Those that were followed for the first time and do not come back to where they were. The search
  // back begins as far off as the one ahead did.
  int DropStrayed(const std::vector<cv::Mat>& pyramid_before, const std::vector<cv::Mat>& pyramid,
                  std::vector<Step>* steps) const {
    std::vector<cv::Point2f> there;
    for (const Step& step : *steps) {
      if (step.feature.image_count == 0) there.push_back(step.after);
    }
    if (there.empty()) return 0;
    std::vector<cv::Point2f> back = there;
    const std::vector<uint8_t> is_found = Search(pyramid, pyramid_before, there, &back);
    size_t next = 0;
    return static_cast<int>(std::erase_if(*steps, [&](const Step& step) {
      if (step.feature.image_count > 0) return false;
      const size_t i = next++;
      const cv::Point2f off = back[i] - step.before;
      return is_found[i] == 0 || std::hypot(off.x, off.y) > options_.back_px_max;
    }));
  }

  bool LooksTheSame(const cv::Mat& image_before, const cv::Point2f& before, const cv::Mat& image,
                    const cv::Point2f& after) const {
    return CorrelationAt(image_before, before, image, after, options_.correlation_reach_px) >=
           options_.correlation_min;
  }

  // Ids ascend, so the older of two comes first.
  int Merge() {
    std::vector<Feature> kept;
    for (const Feature& feature : features_) {
      const bool is_double = std::any_of(kept.begin(), kept.end(), [&](const Feature& older) {
        return IsNear(older.pixel, feature.pixel, options_.merge_px);
      });
      if (!is_double) kept.push_back(feature);
    }
    const int dropped = static_cast<int>(features_.size() - kept.size());
    features_ = std::move(kept);
    return dropped;
  }

  CameraCalibration camera_;
  FeatureTrackerOptions options_;
  cv::Mat image_;
  std::vector<Feature> features_;
  // Those of the image before, for GoBack; none if there is none.
  cv::Mat image_before_;
  std::vector<Feature> features_before_;
  int64_t next_id_ = 0;
};

FeatureTracker::FeatureTracker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
FeatureTracker::~FeatureTracker() = default;
FeatureTracker::FeatureTracker(FeatureTracker&&) noexcept = default;
FeatureTracker& FeatureTracker::operator=(FeatureTracker&&) noexcept = default;

absl::StatusOr<FeatureTracker> FeatureTracker::Make(const CameraCalibration& camera,
                                                    const FeatureTrackerOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  DSG_RETURN_IF_ERROR(camera.Validate());
  if (camera.distortion != Distortion::kNone) {
    return BadInput(camera, "distortion", "not none", "a rectified camera");
  }
  const int side = 2 * (options.border_px + options.window_reach_px) + 1;
  if (camera.width < side || camera.height < side) {
    return BadInput(
        camera, "resolution", SizeText(camera.width, camera.height),
        absl::StrCat("at least ", SizeText(side, side), ", a window within the border"));
  }
  return FeatureTracker(std::make_unique<Impl>(camera, options));
}

absl::StatusOr<TrackCounts> FeatureTracker::Track(
    const Image& image, const std::optional<Eigen::Quaterniond>& last_R_now,
    std::span<const uint8_t> mask) {
  return impl_->Track(image, last_R_now, mask);
}

absl::StatusOr<int> FeatureTracker::Detect(std::span<const uint8_t> mask) {
  return impl_->Detect(mask);
}

void FeatureTracker::Drop(std::span<const int64_t> ids) { impl_->Drop(ids); }
void FeatureTracker::GoBack() { impl_->GoBack(); }
void FeatureTracker::Reset() { impl_->Reset(); }
const std::vector<Feature>& FeatureTracker::features() const { return impl_->features(); }

}  // namespace dsg::ingest
