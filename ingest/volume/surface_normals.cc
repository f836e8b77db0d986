// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/surface_normals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "ingest/volume/parallel.h"

namespace dsg::ingest {
namespace {

constexpr int kTile = 8;

// Moments of x, y (image coordinates at z = 1, from the tile's centre) and inverse depth r.
struct Moments {
  double count = 0, x = 0, y = 0, r = 0, xx = 0, xy = 0, yy = 0, xr = 0, yr = 0, rr = 0;

  void Add(double u, double v, double inverse) {
    count += 1.0;
    x += u;
    y += v;
    r += inverse;
    xx += u * u;
    xy += u * v;
    yy += v * v;
    xr += u * inverse;
    yr += v * inverse;
    rr += inverse * inverse;
  }
  // Adds `other`, whose origin lies at (u, v) of this one's.
  void AddShifted(const Moments& other, double u, double v) {
    count += other.count;
    x += other.x + u * other.count;
    y += other.y + v * other.count;
    r += other.r;
    xx += other.xx + 2.0 * u * other.x + u * u * other.count;
    xy += other.xy + u * other.y + v * other.x + u * v * other.count;
    yy += other.yy + 2.0 * v * other.y + v * v * other.count;
    xr += other.xr + u * other.r;
    yr += other.yr + v * other.r;
    rr += other.rr;
  }
};

// Zero when the pixels are few, in line, or not on a plane.
Eigen::Vector3f Fit(const Moments& m, double center_x, double center_y,
                    const FusionOptions& options) {
  if (m.count < options.normal_pixel_count_min) return Eigen::Vector3f::Zero();
  const double mean_x = m.x / m.count;
  const double mean_y = m.y / m.count;
  const double mean_r = m.r / m.count;
  const double xx = m.xx - mean_x * m.x;
  const double xy = m.xy - mean_x * m.y;
  const double yy = m.yy - mean_y * m.y;
  const double xr = m.xr - mean_x * m.r;
  const double yr = m.yr - mean_y * m.r;
  const double determinant = xx * yy - xy * xy;
  if (determinant < 1e-3 * (xx + yy) * (xx + yy)) return Eigen::Vector3f::Zero();
  const double a = (yy * xr - xy * yr) / determinant;
  const double b = (xx * yr - xy * xr) / determinant;
  const double misfit_r2 = (m.rr - mean_r * m.r - a * xr - b * yr) / m.count;
  const double depth = 1.0 / mean_r;
  const double misfit = std::sqrt(std::max(misfit_r2, 0.0)) * depth * depth;
  if (misfit > options.misfit_m + options.misfit_per_m2 * depth * depth)
    return Eigen::Vector3f::Zero();
  const double c = mean_r - a * (mean_x + center_x) - b * (mean_y + center_y);
  const Eigen::Vector3d plane(a, b, c);
  return (plane / plane.norm()).cast<float>();
}

}  // namespace

SurfaceNormals::SurfaceNormals(const std::vector<float>& reach, const CameraCalibration& camera,
                               const FusionOptions& options, int thread_count)
    : width_((camera.width + kTile - 1) / kTile) {
  const int height = (camera.height + kTile - 1) / kTile;
  std::vector<Moments> tiles(size_t{1} * width_ * height);
  const double step_x = 1.0 / camera.fx;
  const double step_y = 1.0 / camera.fy;
  constexpr double kCenter = 0.5 * (kTile - 1);
  ParallelFor(thread_count, static_cast<size_t>(height), [&](size_t tile_row) {
    const int top = static_cast<int>(tile_row) * kTile;
    for (int row = top; row < std::min(top + kTile, camera.height); ++row) {
      for (int column = 0; column < camera.width; ++column) {
        const float depth = reach[size_t{1} * row * camera.width + column];
        if (depth <= 0.0f) continue;
        tiles[tile_row * width_ + column / kTile].Add((column % kTile - kCenter) * step_x,
                                                      (row - top - kCenter) * step_y, 1.0 / depth);
      }
    }
  });
  normals_.resize(tiles.size());
  ParallelFor(thread_count, static_cast<size_t>(height), [&](size_t tile_row) {
    const int y = static_cast<int>(tile_row);
    for (int x = 0; x < width_; ++x) {
      Moments wide;
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j) {
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width_ - 1); ++i) {
          wide.AddShifted(tiles[size_t{1} * j * width_ + i], (i - x) * kTile * step_x,
                          (j - y) * kTile * step_y);
        }
      }
      const double center_x = (x * kTile + kCenter - camera.cx) * step_x;
      const double center_y = (y * kTile + kCenter - camera.cy) * step_y;
      Eigen::Vector3f& normal = normals_[tile_row * width_ + x];
      normal = Fit(wide, center_x, center_y, options);
      if (normal.isZero()) normal = Fit(tiles[tile_row * width_ + x], center_x, center_y, options);
    }
  });
}

}  // namespace dsg::ingest
