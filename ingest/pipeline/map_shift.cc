// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/map_shift.h"

#include <cmath>

namespace dsg::ingest {
namespace {

constexpr double kCellM = 0.5;
// Around a box: first what touches it, then further out.
constexpr double kMarginsM[] = {0.5, 1.0, 2.0, 4.0};

}  // namespace

double YawOf(const Eigen::Quaterniond& rotation) {
  return 2.0 * std::atan2(rotation.z(), rotation.w());
}

Eigen::Quaterniond TurnAboutZ(double yaw_rad) {
  return {std::cos(0.5 * yaw_rad), 0.0, 0.0, std::sin(0.5 * yaw_rad)};
}

void MapShift::Add(const Eigen::Vector3d& old_map, const Eigen::Vector3d& new_map, double yaw_rad) {
  Cell& cell = cells_[BlockOf(old_map.cast<float>(), kCellM)];
  ++cell.count;
  cell.old_sum += old_map;
  cell.shift_sum += new_map - old_map;
  cell.yaw_sum_rad += std::remainder(yaw_rad, 2.0 * M_PI);
}

MapShift::Cell MapShift::SumOf(const Box3d& box_map) const {
  const BlockIndex low = BlockOf(box_map.min().cast<float>(), kCellM);
  const BlockIndex high = BlockOf(box_map.max().cast<float>(), kCellM);
  Cell sum;
  // Cells are sorted by x first.
  for (auto it = cells_.lower_bound({low.x, INT32_MIN, INT32_MIN}); it != cells_.end(); ++it) {
    const auto& [index, cell] = *it;
    if (index.x > high.x) break;
    if (index.y < low.y || index.y > high.y || index.z < low.z || index.z > high.z) continue;
    sum.count += cell.count;
    sum.old_sum += cell.old_sum;
    sum.shift_sum += cell.shift_sum;
    sum.yaw_sum_rad += cell.yaw_sum_rad;
  }
  return sum;
}

std::optional<Pose3d> MapShift::Around(const Box3d& box_map) const {
  for (const double margin_m : kMarginsM) {
    const Box3d wide(box_map.min().array() - margin_m, box_map.max().array() + margin_m);
    const Cell sum = SumOf(wide);
    if (sum.count == 0) continue;
    const auto count = static_cast<double>(sum.count);
    const Eigen::Vector3d middle = sum.old_sum / count;
    const Eigen::Quaterniond turn = TurnAboutZ(sum.yaw_sum_rad / count);
    // The turn is about the middle of what was summed, where the mean shift holds.
    return Pose3d{middle + sum.shift_sum / count - turn * middle, turn};
  }
  return std::nullopt;
}

}  // namespace dsg::ingest
