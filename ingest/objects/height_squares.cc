// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/height_squares.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace dsg::ingest {
namespace {

// Less than a step of a stair is deep.
constexpr double kSquareM = 0.25;

std::pair<int, int> SquareOf(const Eigen::Vector3d& point) {
  return {static_cast<int>(std::floor(point.x() / kSquareM)),
          static_cast<int>(std::floor(point.y() / kSquareM))};
}

}  // namespace

void AddHeight(const Eigen::Vector3d& point, HeightMap* map) {
  MeanHeight& height = (*map)[SquareOf(point)];
  height.sum_m += point.z();
  ++height.count;
}

std::optional<double> HeightAt(const HeightMap& map, const Eigen::Vector3d& point, int reach) {
  const std::pair<int, int> square = SquareOf(point);
  for (int ring = 0; ring <= reach; ++ring) {
    MeanHeight sum;
    for (int dx = -ring; dx <= ring; ++dx) {
      for (int dy = -ring; dy <= ring; ++dy) {
        if (std::max(std::abs(dx), std::abs(dy)) != ring) continue;
        const auto found = map.find({square.first + dx, square.second + dy});
        if (found == map.end()) continue;
        sum.sum_m += found->second.sum_m;
        sum.count += found->second.count;
      }
    }
    if (sum.count > 0) return sum.Mean();
  }
  return std::nullopt;
}

}  // namespace dsg::ingest
