// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/upright_box.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::ingest {
namespace {

// Of a right angle, to 2 degrees, and then to a quarter of one.
constexpr int kCoarseSteps = 45;
constexpr double kCoarseRad = 0.5 * M_PI / kCoarseSteps;
constexpr int kFineSteps = 8;
// Cost.
constexpr size_t kYawPointCountMax = 500;
// Footprints of upright things have no area; a thickness keeps their length comparable.
constexpr double kThicknessMinM = 0.02;

/// Low and high end without the outermost share.
std::pair<double, double> TrimmedRange(double share, std::vector<double>* values) {
  const auto cut = static_cast<int64_t>(share * static_cast<double>(values->size()));
  const auto low = values->begin() + cut;
  const auto high = values->end() - 1 - cut;
  std::nth_element(values->begin(), low, values->end());
  const double low_value = *low;
  std::nth_element(low, high, values->end());
  return {low_value, *high};
}

std::pair<double, double> RangeAlong(const std::vector<Eigen::Vector3f>& points,
                                     const Eigen::Vector2d& axis, double trim_share,
                                     std::vector<double>* scratch) {
  scratch->resize(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    (*scratch)[i] = axis.x() * static_cast<double>(points[i].x()) +
                    axis.y() * static_cast<double>(points[i].y());
  }
  return TrimmedRange(trim_share, scratch);
}

double FootprintArea(const std::vector<Eigen::Vector3f>& points, double yaw_rad, double trim_share,
                     std::vector<double>* scratch) {
  const Eigen::Vector2d x(std::cos(yaw_rad), std::sin(yaw_rad));
  const Eigen::Vector2d y(-x.y(), x.x());
  const auto [x_low, x_high] = RangeAlong(points, x, trim_share, scratch);
  const auto [y_low, y_high] = RangeAlong(points, y, trim_share, scratch);
  return std::max(x_high - x_low, kThicknessMinM) * std::max(y_high - y_low, kThicknessMinM);
}

/// The same by weight.
std::pair<double, double> WeightedRange(const std::vector<WeightedPoint>& points,
                                        const Eigen::Vector3d& axis, double trim_share) {
  std::vector<std::pair<double, double>> values;
  values.reserve(points.size());
  double total = 0.0;
  for (const WeightedPoint& point : points) {
    values.emplace_back(axis.dot(point.point_map.cast<double>()),
                        static_cast<double>(point.weight));
    total += static_cast<double>(point.weight);
  }
  std::sort(values.begin(), values.end());
  const double cut = trim_share * total;
  size_t low = 0;
  for (double sum = values[low].second; sum <= cut; sum += values[low].second) ++low;
  size_t high = values.size() - 1;
  for (double sum = values[high].second; sum <= cut; sum += values[high].second) --high;
  return {values[low].first, values[high].first};
}

}  // namespace

double LeastFootprintYaw(const std::vector<Eigen::Vector3f>& all_points,
                         const BoxOptions& options) {
  if (all_points.size() < 3) return 0.0;
  // A part of a large object says as well how it is turned.
  std::vector<Eigen::Vector3f> points;
  const size_t step = 1 + all_points.size() / kYawPointCountMax;
  for (size_t i = 0; i < all_points.size(); i += step) points.push_back(all_points[i]);
  std::vector<double> scratch;
  const double upright_area = FootprintArea(points, 0.0, options.trim_share, &scratch);
  double best_area = upright_area;
  double best_rad = 0.0;
  const auto try_yaw = [&](double yaw_rad) {
    const double area = FootprintArea(points, yaw_rad, options.trim_share, &scratch);
    if (area >= best_area) return;
    best_area = area;
    best_rad = yaw_rad;
  };
  for (int i = 1; i < kCoarseSteps; ++i) {
    try_yaw(kCoarseRad * (i - kCoarseSteps / 2));
  }
  const double coarse_rad = best_rad;
  for (int i = -kFineSteps; i <= kFineSteps; ++i) {
    try_yaw(coarse_rad + kCoarseRad * i / kFineSteps);
  }
  return best_area <= (1.0 - options.gain_min) * upright_area ? best_rad : 0.0;
}

UprightBox FitUprightBox(const std::vector<WeightedPoint>& points, double yaw_rad,
                         const BoxOptions& options) {
  const Eigen::Vector3d x(std::cos(yaw_rad), std::sin(yaw_rad), 0.0);
  const Eigen::Vector3d y(-x.y(), x.x(), 0.0);
  const auto [x_low, x_high] = WeightedRange(points, x, options.trim_share);
  const auto [y_low, y_high] = WeightedRange(points, y, options.trim_share);
  const auto [z_low, z_high] = WeightedRange(points, Eigen::Vector3d::UnitZ(), options.trim_share);
  UprightBox box;
  box.map_T_box.position = 0.5 * (x_low + x_high) * x + 0.5 * (y_low + y_high) * y +
                           0.5 * (z_low + z_high) * Eigen::Vector3d::UnitZ();
  box.map_T_box.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  box.size = {x_high - x_low, y_high - y_low, z_high - z_low};
  return box;
}

void ExtendDownTo(double z_m, UprightBox* box) {
  const double top_m = box->map_T_box.position.z() + 0.5 * box->size.z();
  box->size.z() = top_m - z_m;
  box->map_T_box.position.z() = 0.5 * (top_m + z_m);
}

}  // namespace dsg::ingest
