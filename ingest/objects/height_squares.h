// SPDX-License-Identifier: Apache-2.0
// Heights of level surfaces, kept in squares along the floor.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>

namespace dsg::ingest {

struct MeanHeight {
  double sum_m = 0.0;
  int count = 0;
  double Mean() const { return sum_m / count; }
};

/// Mean height of a level surface in each square of 0.25 m that has some of it.
using HeightMap = std::map<std::pair<int, int>, MeanHeight>;

void AddHeight(const Eigen::Vector3d& point, HeightMap* map);

/// Of the square, or of the nearest ones around it, up to `reach` squares away.
std::optional<double> HeightAt(const HeightMap& map, const Eigen::Vector3d& point, int reach);

}  // namespace dsg::ingest
