// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/rectified_pair.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/sensor/pinhole.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr double kBaselineMinM = 0.001;
constexpr double kApartRadMax = 30.0 * M_PI / 180.0;
// Between the line through both cameras and the left one's x axis.
constexpr double kAsideRadMax = 45.0 * M_PI / 180.0;

absl::Status BadPair(const CameraCalibration& left, const CameraCalibration& right,
                     const std::string& field, const std::string& what, double value) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(left.name, " and ", right.name, " give no depth: ", what, " (",
                                value, "); correct sensor.yaml, or map without stereo"),
                   {{"field", field}, {"value", absl::StrCat(value)}});
}

absl::Status CheckPair(const CameraCalibration& left, const CameraCalibration& right) {
  DSG_RETURN_IF_ERROR(left.Validate());
  DSG_RETURN_IF_ERROR(right.Validate());
  if (left.width != right.width || left.height != right.height) {
    return BadPair(left, right, "resolution",
                   "the sizes of their images differ, by columns and rows",
                   std::abs(left.width - right.width) + std::abs(left.height - right.height));
  }
  const double baseline_m = CentreDistance(left, right);
  if (baseline_m < kBaselineMinM) {
    return BadPair(left, right, "T_BS", "their distance in metres must be at least 0.001",
                   baseline_m);
  }
  const Eigen::Matrix3d left_R = left.body_T_camera.orientation.toRotationMatrix();
  const Eigen::Matrix3d right_R = right.body_T_camera.orientation.toRotationMatrix();
  const double apart = std::acos(std::clamp(left_R.col(2).dot(right_R.col(2)), -1.0, 1.0));
  if (apart > kApartRadMax) {
    return BadPair(left, right, "T_BS", "they look apart by more than 30 degrees",
                   apart * 180 / M_PI);
  }
  const Eigen::Vector3d line =
      (right.body_T_camera.position - left.body_T_camera.position) / baseline_m;
  const double aside = std::acos(std::clamp(std::abs(line.dot(left_R.col(0))), -1.0, 1.0));
  if (aside > kAsideRadMax) {
    return BadPair(left, right, "T_BS",
                   "they are not side by side: degrees between the left one's rows and the other "
                   "camera must be at most 45",
                   aside * 180 / M_PI);
  }
  return absl::OkStatus();
}

// Mean place, focal length 1, of an image's border seen in direction `body_R`.
std::optional<Eigen::Vector2d> MiddleOf(const CameraCalibration& camera,
                                        const Eigen::Matrix3d& body_R) {
  const Eigen::Matrix3d rectified_R_camera =
      body_R.transpose() * camera.body_T_camera.orientation.toRotationMatrix();
  Eigen::AlignedBox2d seen;
  constexpr int kSteps = 8;
  for (int i = 0; i <= kSteps; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    const double u = s * (camera.width - 1);
    const double v = s * (camera.height - 1);
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(u, 0.0), Eigen::Vector2d(u, camera.height - 1.0), Eigen::Vector2d(0.0, v),
          Eigen::Vector2d(camera.width - 1.0, v)}) {
      const std::optional<Eigen::Vector3d> ray = RayOf(camera, pixel);
      if (!ray.has_value()) continue;
      const Eigen::Vector3d turned = rectified_R_camera * *ray;
      if (turned.z() > 0.0) seen.extend(Eigen::Vector2d(turned.head<2>() / turned.z()));
    }
  }
  if (seen.isEmpty()) return std::nullopt;
  return seen.center();
}

}  // namespace

absl::StatusOr<RectifiedPair> RectifiedPair::Make(const CameraCalibration& left,
                                                  const CameraCalibration& right) {
  DSG_RETURN_IF_ERROR(CheckPair(left, right));
  const Eigen::Matrix3d left_R = left.body_T_camera.orientation.toRotationMatrix();
  const Eigen::Matrix3d right_R = right.body_T_camera.orientation.toRotationMatrix();
  const Eigen::Vector3d line = right.body_T_camera.position - left.body_T_camera.position;
  const double side = line.dot(left_R.col(0)) > 0.0 ? 1.0 : -1.0;
  Eigen::Matrix3d body_R;
  body_R.col(0) = side * line.normalized();
  body_R.col(1) = (left_R.col(2) + right_R.col(2)).cross(body_R.col(0)).normalized();
  body_R.col(2) = body_R.col(0).cross(body_R.col(1));
  const double focal = 0.25 * (left.fx + left.fy + right.fx + right.fy);
  const std::optional<Eigen::Vector2d> left_middle = MiddleOf(left, body_R);
  const std::optional<Eigen::Vector2d> right_middle = MiddleOf(right, body_R);
  if (!left_middle.has_value() || !right_middle.has_value()) {
    return BadPair(left, right, "distortion_coefficients", "their distortion cannot be undone",
                   NAN);
  }
  const Eigen::Vector2d middle = 0.5 * (*left_middle + *right_middle);
  RectifiedPair pair;
  pair.baseline_m = side * line.norm();
  for (auto& [rectified, camera] : {std::pair(&pair.left, &left), std::pair(&pair.right, &right)}) {
    *rectified = WithoutDistortion(*camera);
    rectified->fx = rectified->fy = focal;
    rectified->cx = 0.5 * (camera->width - 1) - focal * middle.x();
    rectified->cy = 0.5 * (camera->height - 1) - focal * middle.y();
    rectified->body_T_camera.orientation = Eigen::Quaterniond(body_R).normalized();
  }
  return pair;
}

}  // namespace dsg::ingest
