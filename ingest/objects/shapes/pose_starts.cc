// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/pose_starts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ingest/objects/shapes/alignment.h"
#include "ingest/objects/shapes/surface.h"

namespace dsg::ingest {
namespace {

// Low and high end without the farthest points.
std::array<double, 2> RangeOf(const std::vector<Eigen::Vector3d>& points, int axis,
                              double trim_share) {
  std::vector<double> values(points.size());
  for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
  std::sort(values.begin(), values.end());
  const auto trim = static_cast<size_t>(trim_share * static_cast<double>(values.size()));
  return {values[trim], values[values.size() - 1 - trim]};
}

// Shifts that bring the model's range flush with the points' range or to its middle.
std::vector<double> ShiftsAlong(int axis, const std::vector<Eigen::Vector3d>& points,
                                const Box3d& box, double trim_share) {
  const auto [low, high] = RangeOf(points, axis, trim_share);
  std::vector<double> shifts = {low - box.min()[axis], high - box.max()[axis]};
  if (axis < 2) shifts.push_back(0.5 * (shifts[0] + shifts[1]));
  return shifts;
}

}  // namespace

std::vector<Start> KeepDistinct(const std::vector<Start>& starts, size_t count,
                                const StartOptions& options) {
  const double same_rad = options.same_deg * std::numbers::pi / 180.0;
  std::vector<Start> kept;
  for (const Start& start : starts) {
    if (kept.size() >= count) break;
    const bool is_known = std::any_of(kept.begin(), kept.end(), [&](const Start& other) {
      return (start.map_T_model.position - other.map_T_model.position).norm() < options.same_m &&
             AngleBetween(start.map_T_model.orientation, other.map_T_model.orientation) < same_rad;
    });
    if (!is_known) kept.push_back(start);
  }
  return kept;
}

std::vector<Start> FindStarts(const ModelIndex& model,
                              const std::vector<Eigen::Vector3d>& points_map,
                              std::optional<double> floor_z_map, size_t count,
                              const StartOptions& options) {
  const std::vector<Eigen::Vector3d> few =
      EveryNth(points_map, static_cast<size_t>(options.look_count));
  std::vector<Start> starts;
  for (int turn = 0; turn < options.turn_count; ++turn) {
    const Eigen::Quaterniond orientation(Eigen::AngleAxisd(
        2.0 * std::numbers::pi * turn / options.turn_count, Eigen::Vector3d::UnitZ()));
    std::vector<Eigen::Vector3d> turned;
    for (const Eigen::Vector3d& point : points_map) {
      turned.push_back(orientation.conjugate() * point);
    }
    std::vector<double> heights = ShiftsAlong(2, turned, model.box(), options.trim_share);
    if (floor_z_map) heights = {*floor_z_map - model.box().min().z()};
    for (const double x : ShiftsAlong(0, turned, model.box(), options.trim_share)) {
      for (const double y : ShiftsAlong(1, turned, model.box(), options.trim_share)) {
        for (const double z : heights) {
          const Pose3d pose{orientation * Eigen::Vector3d(x, y, z), orientation};
          starts.push_back({pose, Explain(model, few, pose, options.near_m, false).cost});
        }
      }
    }
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Start& a, const Start& b) { return a.cost < b.cost; });
  return KeepDistinct(starts, count, options);
}

}  // namespace dsg::ingest
