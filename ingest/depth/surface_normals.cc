// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/surface_normals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<NormalOptions> kNormalFields[] = {
    {"up-window", &NormalOptions::window_share, 0.005, 0.5,
     "Edge of the windows that normals are fitted to, share of the width of the picture: a wider "
     "one tames noise, a narrower one finds more"},
    {"up-window-step", &NormalOptions::step_share_max, 0.001, 1.0,
     "Readings of a window that are further off than this are another surface, share of the "
     "distance"},
    {"up-window-rough", &NormalOptions::roughness_max, 0.01, 10.0,
     "Windows are flat if they are no rougher than this, share of their width: noise of depth"},
};

// The inverse depth of a plane is linear in the ray, and errs alike all over a window: a fit of
// points instead would lean towards the camera.
std::optional<Eigen::Vector3d> NormalAt(const DepthFrame& frame, int column, int row, int reach,
                                        const NormalOptions& options) {
  const CameraCalibration& camera = frame.camera;
  const auto depth_at = [&](int u, int v) {
    return static_cast<double>(frame.depth_m[static_cast<size_t>(v * camera.width + u)]);
  };
  const double centre_m = depth_at(column, row);
  if (centre_m <= 0.0) return std::nullopt;
  const Eigen::Vector3d centre_ray = PinholeRay(camera, column, row);
  // Around the middle of the window, in shares of the middle's depth.
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  double inverse_squares = 0.0;
  int count = 0;
  int missing = 0;
  const int step = std::max(1, reach / 4);
  for (int v = row - reach; v <= row + reach; v += step) {
    for (int u = column - reach; u <= column + reach; u += step) {
      const double depth_m = depth_at(u, v);
      if (depth_m <= 0.0 || std::abs(depth_m - centre_m) > options.step_share_max * centre_m) {
        ++missing;
        continue;
      }
      Eigen::Vector3d ray = PinholeRay(camera, u, v) - centre_ray;
      ray.z() = 1.0;
      const double inverse = centre_m / depth_m;
      squares += ray * ray.transpose();
      products += inverse * ray;
      inverse_squares += inverse * inverse;
      ++count;
    }
  }
  // A corner of the window may be another surface: no option.
  if (missing > count / 4) return std::nullopt;
  const Eigen::Vector3d plane = squares.ldlt().solve(products);
  const double roughness = std::sqrt(std::max(0.0, inverse_squares - plane.dot(products)) / count);
  const double width = std::sqrt((squares(0, 0) + squares(1, 1)) / (2.0 * count));
  if (!plane.allFinite() || roughness > options.roughness_max * width) return std::nullopt;
  // Back to rays from the camera; the plane is where normal . point = 1.
  const double constant = plane.z() - plane.head<2>().dot(centre_ray.head<2>());
  return -Eigen::Vector3d(plane.x(), plane.y(), constant).normalized();
}

}  // namespace

std::vector<BoundOption> NormalOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<NormalOptions>(kNormalFields, this, &bound);
  return bound;
}

std::vector<Eigen::Vector3d> SurfaceNormals(const DepthFrame& frame, int count,
                                            const NormalOptions& options) {
  const int width = frame.camera.width;
  const int height = frame.camera.height;
  const int reach = std::max(2, static_cast<int>(0.5 * options.window_share * width));
  const int stride = std::max(
      1, static_cast<int>(std::sqrt(static_cast<double>(width) * height / std::max(count, 1))));
  std::vector<Eigen::Vector3d> normals;
  for (int row = reach; row + reach < height; row += stride) {
    for (int column = reach; column + reach < width; column += stride) {
      const std::optional<Eigen::Vector3d> normal = NormalAt(frame, column, row, reach, options);
      if (normal.has_value()) normals.push_back(frame.map_T_camera.orientation * *normal);
    }
  }
  return normals;
}

}  // namespace dsg::ingest
