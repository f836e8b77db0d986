// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/detection_filter.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

bool AllFinite(const std::vector<float>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float x) { return std::isfinite(x); });
}

bool JointsAreFinite(const HumanDetection& detection) {
  if (!detection.has_joints) return true;
  for (size_t j = 0; j < size_t{kJointCount}; ++j) {
    if (!detection.joints_root[j].allFinite() || !detection.joints_px[j].allFinite() ||
        !std::isfinite(detection.joint_visibility[j])) {
      return false;
    }
  }
  return true;
}

bool IsFinite(const HumanDetection& detection) {
  const bool camera_is_finite =
      detection.pelvis_camera.has_value()
          ? detection.pelvis_camera->allFinite()
          : std::isfinite(detection.weak_scale) && std::isfinite(detection.crop_px) &&
                detection.weak_translation.allFinite() && detection.crop_center_px.allFinite();
  return std::isfinite(detection.score) && detection.box_px.allFinite() && camera_is_finite &&
         JointsAreFinite(detection) && AllFinite(detection.pose_coefficients) &&
         AllFinite(detection.shape_coefficients) && AllFinite(detection.vertices_root);
}

bool CountsAreRight(const HumanDetection& detection) {
  const size_t pose_count = detection.pose_coefficients.size();
  const size_t shape_count = detection.shape_coefficients.size();
  return (pose_count == 0 || pose_count == kPoseCoefficientCount) &&
         (shape_count == 0 || shape_count == size_t{kShapeCount}) &&
         detection.vertices_root.size() % 3 == 0;
}

constexpr OptionField<DetectionFilterOptions> kFields[] = {
    {"person-border", &DetectionFilterOptions::border_px, 0.0, 1000.0,
     "Boxes this near to the image's border count as cut off, pixels: RSS 2020 rejects them, and "
     "networks' boxes end some pixels before"},
    {"person-side-min", &DetectionFilterOptions::side_px_min, 0.0, 10000.0,
     "Larger side of a box at least, pixels: RSS 2020 has 30"},
    {"person-score-min", &DetectionFilterOptions::score_min, 0.0, 1.0,
     "Least score of a detection: logs have had their own threshold before"},
};

}  // namespace

std::vector<BoundOption> DetectionFilterOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<DetectionFilterOptions>(kFields, this, &bound);
  return bound;
}

std::optional<std::string_view> WhyRejected(const HumanDetection& detection,
                                            const CameraCalibration& camera,
                                            const DetectionFilterOptions& options) {
  if (!IsFinite(detection)) return "a number is not finite";
  if (!CountsAreRight(detection)) return "wrong count of coefficients or vertices";
  const double left = detection.box_px[0];
  const double top = detection.box_px[1];
  const double right = detection.box_px[2];
  const double bottom = detection.box_px[3];
  if (!(left < right && top < bottom)) return "box inverted or empty";
  const double right_max = camera.width - 1;
  const double bottom_max = camera.height - 1;
  if (right <= 0.0 || bottom <= 0.0 || left >= right_max || top >= bottom_max) {
    return "box outside the image";
  }
  if (detection.score < options.score_min) return "score too low";
  if (std::max(right - left, bottom - top) <= options.side_px_min) return "box too small";
  const double border_px = options.border_px;
  if (left <= border_px || top <= border_px || right >= right_max - border_px ||
      bottom >= bottom_max - border_px) {
    return kAtBorder;
  }
  return std::nullopt;
}

}  // namespace dsg::ingest
