// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/keyframe_sights.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {

SeenFeatures FeaturesOf(const FeatureTracker& tracker) {
  SeenFeatures features;
  for (const Feature& feature : tracker.features()) features[feature.id].pixel = feature.pixel;
  return features;
}

absl::StatusOr<SeenFeatures> SeeKeyframe(const OdometryFrame& frame, const CameraCalibration& left,
                                         FeatureTracker* tracker,
                                         const Eigen::Quaterniond& now_R_depth) {
  DSG_RETURN_IF_ERROR(tracker->Detect(frame.mask).status());
  SeenFeatures features = FeaturesOf(*tracker);
  const bool has_turned = !now_R_depth.vec().isZero(0.0);
  const Eigen::Matrix3d depth_R_now = now_R_depth.conjugate().toRotationMatrix();
  std::vector<Eigen::Vector2d> pixels;
  // Depth along the optical axis of then, for one along that of now.
  std::vector<double> lengths;
  for (const auto& [id, seen] : features) {
    pixels.push_back(seen.pixel);
    lengths.push_back(1.0);
    if (!has_turned) continue;
    const Eigen::Vector3d ray = depth_R_now * PinholeRay(left, seen.pixel.x(), seen.pixel.y());
    // What is behind the camera by then is outside its image.
    pixels.back() = ray.z() > 0.0 ? Project(left, ray) : Eigen::Vector2d(-1.0, -1.0);
    lengths.back() = ray.z();
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<std::optional<double>> disparities,
                       frame.disparities(frame.left, pixels));
  size_t index = 0;
  for (auto& [id, seen] : features) {
    if (disparities[index].has_value()) seen.disparity_px = *disparities[index] * lengths[index];
    ++index;
  }
  return features;
}

std::vector<FeatureSight> SightsOf(const SeenFeatures& features) {
  std::vector<FeatureSight> sights;
  for (const auto& [id, seen] : features) sights.push_back({id, {seen.pixel, seen.disparity_px}});
  return sights;
}

int64_t SharedCount(const SeenFeatures& last, const SeenFeatures& now) {
  return std::count_if(now.begin(), now.end(),
                       [&](const auto& entry) { return last.contains(entry.first); });
}

bool HasMoved(const StereoCamera& camera, const SeenFeatures& last, const SeenFeatures& now,
              const Eigen::Quaterniond& last_R_now, const OdometryKeyframeOptions& options) {
  if (static_cast<double>(SharedCount(last, now)) <
      options.share_min * static_cast<double>(last.size())) {
    return true;
  }
  const std::optional<double> parallax_px = ParallaxOf(camera, last, now, last_R_now);
  return parallax_px.has_value() && *parallax_px >= options.parallax_px;
}

Matrix6d CovarianceAt(const Matrix6d& covariance, const Pose3d& map_T_a, const Pose3d& a_T_b) {
  const Eigen::Matrix3d map_R_a = map_T_a.orientation.toRotationMatrix();
  const Eigen::Vector3d lever = map_R_a * a_T_b.position;
  Matrix6d by_a = Matrix6d::Zero();
  by_a.topLeftCorner<3, 3>().setIdentity();
  by_a.topRightCorner<3, 3>() = -CrossMatrix(lever) * map_R_a;
  by_a.bottomRightCorner<3, 3>() = a_T_b.orientation.conjugate().toRotationMatrix();
  return by_a * covariance * by_a.transpose();
}

absl::Status BadFrame(TimeNs time_ns, const std::string& what) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("the image at ", time_ns, " ns ", what),
                   {{"field", "time_ns"}, {"value", absl::StrCat(time_ns)}});
}

}  // namespace dsg::ingest
