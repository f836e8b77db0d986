// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/roadmap.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

constexpr double kBinM = 2.0;

std::pair<int, int> Ordered(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

Roadmap::Bin Roadmap::BinOf(const Eigen::Vector3d& point_map) {
  const Eigen::Vector3i bin = (point_map / kBinM).array().floor().cast<int>();
  return {bin.z(), bin.y(), bin.x()};
}

int Roadmap::Add(int64_t cell) {
  const auto [found, is_new] = spot_at_.emplace(cell, spot_count());
  if (is_new) {
    cells_.push_back(cell);
    bins_[BinOf(space_->CenterOf(cell))].push_back(found->second);
  }
  return found->second;
}

int Roadmap::SpotAt(int64_t cell) const {
  const auto found = spot_at_.find(cell);
  return found == spot_at_.end() ? -1 : found->second;
}

bool Roadmap::IsLinked(int a, int b) const { return links_.count(Ordered(a, b)) != 0; }

bool Roadmap::Link(int a, int b) {
  if (a == b) return false;
  if (IsLinked(a, b)) return true;
  if (!space_->IsOpenWay(cell(a), cell(b))) return false;
  links_.insert(Ordered(a, b));
  return true;
}

std::vector<std::pair<double, int>> Roadmap::Near(const Eigen::Vector3d& point_map,
                                                  double range_m) const {
  std::vector<std::pair<double, int>> near;
  const Bin low = BinOf(point_map - Eigen::Vector3d::Constant(range_m));
  const Bin high = BinOf(point_map + Eigen::Vector3d::Constant(range_m));
  for (int z = low[0]; z <= high[0]; ++z) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int x = low[2]; x <= high[2]; ++x) {
        const auto found = bins_.find({z, y, x});
        if (found == bins_.end()) continue;
        for (const int spot : found->second) {
          const double distance_m = (position_map(spot) - point_map).norm();
          if (distance_m <= range_m) near.emplace_back(distance_m, spot);
        }
      }
    }
  }
  std::sort(near.begin(), near.end());
  return near;
}

bool Roadmap::IsNearInSight(int64_t cell, double range_m) const {
  for (const auto& [distance_m, spot] : Near(space_->CenterOf(cell), range_m)) {
    if (this->cell(spot) == cell || space_->IsOpenWay(cell, this->cell(spot))) return true;
  }
  return false;
}

}  // namespace dsg::ingest
