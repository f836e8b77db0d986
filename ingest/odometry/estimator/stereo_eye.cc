// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/stereo_eye.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/image_rectifier.h"
#include "ingest/odometry/frontend/stereo_match.h"
#include "ingest/sensor/pinhole.h"
#include "ingest/sensor/rectified_pair.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector2d;

// Of depth cameras: that of the infrared pairs in them, metres.
constexpr double kDepthBaselineM = 0.1;

using Disparities = std::vector<std::optional<double>>;

// Pixels of the rectified camera that are not to be used.
class MaskMaker {
 public:
  MaskMaker(const CameraCalibration& rectified, const CameraCalibration& real)
      : lookup_(MakeRectifyLookup(rectified, real)), width_(real.width), height_(real.height) {}

  std::vector<uint8_t> MaskOf(const Image& labels, std::span<const int32_t> classes) const {
    std::vector<uint8_t> mask(lookup_.inside.size(), 0);
    const bool fits = labels.format == PixelFormat::kLabel16 && labels.width == width_ &&
                      labels.height == height_;
    bool is_anywhere = false;
    for (size_t i = 0; i < mask.size(); ++i) {
      bool is_masked = lookup_.inside[i] == 0;
      if (!is_masked && fits) {
        const int column = static_cast<int>(std::lround(lookup_.u[i]));
        const int row = static_cast<int>(std::lround(lookup_.v[i]));
        is_masked =
            std::binary_search(classes.begin(), classes.end(), LabelAt(labels, column, row) >> 8);
      }
      mask[i] = is_masked ? 1 : 0;
      is_anywhere |= is_masked;
    }
    return is_anywhere ? mask : std::vector<uint8_t>();
  }

 private:
  RectifyLookup lookup_;
  int width_;
  int height_;
};

class StereoEye : public OdometryEye {
 public:
  StereoEye(const RectifiedPair& pair, const CameraCalibration& left,
            const CameraCalibration& right, StereoMatcher matcher)
      : camera_{pair.left, std::abs(pair.baseline_m)},
        left_(pair.left, left),
        right_(pair.right, right),
        matcher_(std::move(matcher)),
        masks_(pair.left, left) {}

  const StereoCamera& camera() const override { return camera_; }

  absl::StatusOr<OdometryFrame> FrameOf(TimeNs time_ns, const Image& left, ImageLoad other,
                                        std::vector<uint8_t> mask) const override {
    OdometryFrame frame;
    frame.time_ns = time_ns;
    DSG_ASSIGN_OR_RETURN(const Image gray, GrayOf(left));
    DSG_ASSIGN_OR_RETURN(frame.left, left_.Apply(gray));
    frame.mask = mask.empty() ? left_.unseen() : std::move(mask);
    frame.disparities = [this, load = std::move(other)](const Image& rectified,
                                                        std::span<const Vector2d> pixels) {
      return Match(rectified, load, pixels);
    };
    return frame;
  }

  std::vector<uint8_t> MaskOf(const Image& labels,
                              std::span<const int32_t> classes) const override {
    return masks_.MaskOf(labels, classes);
  }

 private:
  absl::StatusOr<Disparities> Match(const Image& left, const ImageLoad& load_right,
                                    std::span<const Vector2d> pixels) const {
    DSG_ASSIGN_OR_RETURN(const Image right, load_right());
    DSG_ASSIGN_OR_RETURN(const Image gray, GrayOf(right));
    DSG_ASSIGN_OR_RETURN(const Image rectified, right_.Apply(gray));
    DSG_ASSIGN_OR_RETURN(const std::vector<StereoMatch> matches,
                         matcher_.Match(left, rectified, pixels));
    Disparities disparities;
    for (const StereoMatch& match : matches) {
      const bool is_matched = match.outcome == StereoOutcome::kMatched;
      disparities.push_back(is_matched ? std::optional(match.disparity_px) : std::nullopt);
    }
    return disparities;
  }

  const StereoCamera camera_;
  const ImageRectifier left_;
  const ImageRectifier right_;
  const StereoMatcher matcher_;
  const MaskMaker masks_;
};

class DepthEye : public OdometryEye {
 public:
  DepthEye(const CameraCalibration& camera, const StereoMatchOptions& options)
      : camera_{WithoutDistortion(camera), kDepthBaselineM, /*has_depth=*/true},
        real_(camera),
        options_(options),
        rectifier_(camera_.left, camera),
        masks_(camera_.left, camera) {}

  const StereoCamera& camera() const override { return camera_; }

  absl::StatusOr<OdometryFrame> FrameOf(TimeNs time_ns, const Image& left, ImageLoad other,
                                        std::vector<uint8_t> mask) const override {
    OdometryFrame frame;
    frame.time_ns = time_ns;
    DSG_ASSIGN_OR_RETURN(const Image gray, GrayOf(left));
    DSG_ASSIGN_OR_RETURN(frame.left, rectifier_.Apply(gray));
    frame.mask = mask.empty() ? rectifier_.unseen() : std::move(mask);
    frame.disparities = [this, load = std::move(other)](const Image&,
                                                        std::span<const Vector2d> pixels) {
      return Read(load, pixels);
    };
    return frame;
  }

  std::vector<uint8_t> MaskOf(const Image& labels,
                              std::span<const int32_t> classes) const override {
    return masks_.MaskOf(labels, classes);
  }

 private:
  absl::StatusOr<Disparities> Read(const ImageLoad& load_depth,
                                   std::span<const Vector2d> pixels) const {
    DSG_ASSIGN_OR_RETURN(const Image depth, load_depth());
    const bool is_depth =
        depth.format == PixelFormat::kDepth16 || depth.format == PixelFormat::kDepth32;
    if (!is_depth || depth.width != real_.width || depth.height != real_.height) {
      return MakeError(Reason::kFieldInvalid,
                       absl::StrCat("a depth image is ", depth.width, " x ", depth.height, " ",
                                    std::string(Name(depth.format)), "; give ", real_.width, " x ",
                                    real_.height, " of depth"),
                       {{"field", "depth0"}});
    }
    Disparities disparities;
    for (const Vector2d& pixel : pixels) disparities.push_back(DisparityIn(depth, pixel));
    return disparities;
  }

  // Along the edge of a thing depth is that of one side or of the other, and the corner's is
  // neither: there it is not clear.
  std::optional<double> DisparityIn(const Image& depth, const Vector2d& pixel) const {
    constexpr int kReachPx = 2;
    constexpr float kStepShare = 0.05f;
    const Vector2d at = Project(real_, PinholeRay(camera_.left, pixel.x(), pixel.y()));
    const int column = static_cast<int>(std::lround(at.x()));
    const int row = static_cast<int>(std::lround(at.y()));
    if (column < kReachPx || row < kReachPx || column >= depth.width - kReachPx ||
        row >= depth.height - kReachPx) {
      return std::nullopt;
    }
    const float here = DepthAt(depth, column, row);
    if (here < options_.nearest_m || here > options_.farthest_m) return std::nullopt;
    for (int v = -kReachPx; v <= kReachPx; ++v) {
      for (int u = -kReachPx; u <= kReachPx; ++u) {
        const float there = DepthAt(depth, column + u, row + v);
        if (there > 0.0f && std::abs(there - here) > kStepShare * here) return std::nullopt;
      }
    }
    return camera_.left.fx * kDepthBaselineM / static_cast<double>(here);
  }

  const StereoCamera camera_;
  const CameraCalibration real_;
  const StereoMatchOptions options_;
  const ImageRectifier rectifier_;
  const MaskMaker masks_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<OdometryEye>> MakeStereoEye(const CameraCalibration& left,
                                                           const CameraCalibration& right,
                                                           const StereoMatchOptions& options) {
  DSG_ASSIGN_OR_RETURN(const RectifiedPair pair, RectifiedPair::Make(left, right));
  DSG_ASSIGN_OR_RETURN(StereoMatcher matcher, StereoMatcher::Make(pair, options));
  return std::make_unique<StereoEye>(pair, left, right, std::move(matcher));
}

absl::StatusOr<std::unique_ptr<OdometryEye>> MakeDepthEye(const CameraCalibration& camera,
                                                          const CameraCalibration& depth,
                                                          const StereoMatchOptions& options) {
  const Pose3d apart = camera.body_T_camera.Inverse() * depth.body_T_camera;
  const bool is_registered =
      camera.width == depth.width && camera.height == depth.height && camera.fx == depth.fx &&
      camera.fy == depth.fy && camera.cx == depth.cx && camera.cy == depth.cy &&
      apart.position.norm() < 1e-3 && std::abs(apart.orientation.w()) > 1.0 - 1e-6;
  if (!is_registered) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(depth.name, " is another camera than ", camera.name,
                                  "; odometry takes depth that is registered to the image"),
                     {{"field", depth.name}});
  }
  return std::make_unique<DepthEye>(camera, options);
}

absl::StatusOr<Image> GrayOf(const Image& image) {
  if (image.format == PixelFormat::kGray8) return image;
  if (image.format != PixelFormat::kRgb8) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("an image is ", std::string(Name(image.format)),
                                  "; odometry takes gray8 or rgb8"),
                     {{"field", "image"}, {"value", std::string(Name(image.format))}});
  }
  Image gray{image.width, image.height, PixelFormat::kGray8, {}};
  gray.bytes.resize(image.bytes.size() / 3);
  for (size_t i = 0; i < gray.bytes.size(); ++i) {
    // ITU-R BT.601.
    const int luminance =
        299 * image.bytes[3 * i] + 587 * image.bytes[3 * i + 1] + 114 * image.bytes[3 * i + 2];
    gray.bytes[i] = static_cast<uint8_t>((luminance + 500) / 1000);
  }
  return gray;
}

}  // namespace dsg::ingest
