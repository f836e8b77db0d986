// SPDX-License-Identifier: Apache-2.0
#include "ingest/sensor/calibration.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Of 80 degrees.
constexpr double kTanHalfViewMax = 5.671;
constexpr int kSideMax = 16384;
// Beyond those of any lens before the largest picture.
constexpr double kFocalMaxPx = 1e7;
constexpr double kCenterMaxPx = 1e5;
constexpr int64_t kPixelsMax = 16'000'000;

absl::Status Bad(const std::string& sensor, const std::string& field, double value,
                 const std::string& bound) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(sensor, ": ", field, " is ", value, "; it must be ", bound),
                   {{"field", absl::StrCat(sensor, ".", field)}, {"value", absl::StrCat(value)}});
}

absl::Status CheckPositive(const std::string& sensor, const std::string& field, double value) {
  if (std::isfinite(value) && value > 0.0) return absl::OkStatus();
  return Bad(sensor, field, value, "a positive number");
}

absl::Status CheckNotNegative(const std::string& sensor, const std::string& field, double value) {
  if (std::isfinite(value) && value >= 0.0) return absl::OkStatus();
  return Bad(sensor, field, value, "zero or a positive number");
}

absl::Status CheckPose(const std::string& sensor, const std::string& field, const Pose3d& pose) {
  if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite()) {
    return Bad(sensor, field, NAN, "finite");
  }
  if (std::abs(pose.orientation.norm() - 1.0) > 1e-6) {
    return Bad(sensor, absl::StrCat(field, " (norm of the rotation)"), pose.orientation.norm(),
               "1");
  }
  return absl::OkStatus();
}

Eigen::Vector2d RadialTangential(const std::vector<double>& k, const Eigen::Vector2d& p) {
  const double r2 = p.squaredNorm();
  const double k3 = k.size() > 4 ? k[4] : 0.0;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k3));
  const double xy = p.x() * p.y();
  return {p.x() * radial + 2.0 * k[2] * xy + k[3] * (r2 + 2.0 * p.x() * p.x()),
          p.y() * radial + k[2] * (r2 + 2.0 * p.y() * p.y()) + 2.0 * k[3] * xy};
}

Eigen::Vector2d Equidistant(const std::vector<double>& k, const Eigen::Vector2d& p) {
  const double r = p.norm();
  if (r < 1e-9) return p;
  const double t = std::atan(r);
  const double t2 = t * t;
  const double bent = t * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  return p * (bent / r);
}

}  // namespace

absl::Status CameraCalibration::Validate() const {
  for (const auto& [field, value] : {std::pair("width", width), std::pair("height", height)}) {
    if (value < 1 || value > kSideMax) {
      return Bad(name, field, value, absl::StrCat("1 to ", kSideMax));
    }
  }
  if (int64_t{width} * height > kPixelsMax) {
    return Bad(name, "width * height", static_cast<double>(width) * height,
               absl::StrCat("at most ", kPixelsMax));
  }
  DSG_RETURN_IF_ERROR(CheckPositive(name, "fx", fx));
  DSG_RETURN_IF_ERROR(CheckPositive(name, "fy", fy));
  // Normalised intrinsics, or those of another camera: nothing looks that wide through a pinhole.
  if (distortion != Distortion::kEquidistant && width > 2.0 * kTanHalfViewMax * fx) {
    return Bad(name, "fx", fx,
               absl::StrCat("at least ", width / (2.0 * kTanHalfViewMax),
                            " pixels, which is a view of 160 degrees"));
  }
  DSG_RETURN_IF_ERROR(CheckNotNegative(name, "rate_hz", rate_hz));
  for (const auto& [field, value] : {std::pair("fx", fx), std::pair("fy", fy)}) {
    if (value <= kFocalMaxPx) continue;
    return Bad(name, field, value, absl::StrCat("at most ", kFocalMaxPx, " pixels"));
  }
  for (const auto& [field, value] : {std::pair("cx", cx), std::pair("cy", cy)}) {
    if (std::abs(value) <= kCenterMaxPx) continue;
    return Bad(name, field, value,
               absl::StrCat("within -", kCenterMaxPx, " to ", kCenterMaxPx, " pixels"));
  }
  const size_t count = distortion_coefficients.size();
  for (const double value : distortion_coefficients) {
    if (!std::isfinite(value)) return Bad(name, "distortion_coefficients", value, "finite");
  }
  const bool fits = distortion == Distortion::kNone ||
                    (distortion == Distortion::kEquidistant && count == 4) ||
                    (distortion == Distortion::kRadialTangential && (count == 4 || count == 5));
  if (!fits) {
    return Bad(name, "count of distortion_coefficients", static_cast<double>(count),
               "4, or 4 to 5 for radial-tangential");
  }
  return CheckPose(name, "body_T_camera", body_T_camera);
}

absl::Status ImuCalibration::Validate() const {
  DSG_RETURN_IF_ERROR(CheckPositive(name, "rate_hz", rate_hz));
  DSG_RETURN_IF_ERROR(CheckNotNegative(name, "gyroscope_noise_density", gyro_noise_density));
  DSG_RETURN_IF_ERROR(CheckNotNegative(name, "gyroscope_random_walk", gyro_random_walk));
  DSG_RETURN_IF_ERROR(CheckNotNegative(name, "accelerometer_noise_density", accel_noise_density));
  DSG_RETURN_IF_ERROR(CheckNotNegative(name, "accelerometer_random_walk", accel_random_walk));
  return CheckPose(name, "body_T_imu", body_T_imu);
}

absl::Status LidarCalibration::Validate() const {
  return CheckPose(name, "body_T_lidar", body_T_lidar);
}

const CameraCalibration* RigCalibration::FindCamera(std::string_view name) const {
  for (const CameraCalibration& camera : cameras) {
    if (camera.name == name) return &camera;
  }
  return nullptr;
}

Eigen::Vector2d Project(const CameraCalibration& camera, const Eigen::Vector3d& point_camera) {
  Eigen::Vector2d p = point_camera.head<2>() / point_camera.z();
  if (camera.distortion == Distortion::kRadialTangential) {
    p = RadialTangential(camera.distortion_coefficients, p);
  } else if (camera.distortion == Distortion::kEquidistant) {
    p = Equidistant(camera.distortion_coefficients, p);
  }
  return {camera.fx * p.x() + camera.cx, camera.fy * p.y() + camera.cy};
}

}  // namespace dsg::ingest
