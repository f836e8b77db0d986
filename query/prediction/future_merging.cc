// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/future_merging.h"

#include <algorithm>
#include <numeric>

namespace dsg::query {
namespace {

/// Instants at which two futures are compared.
constexpr size_t kComparedCount = 6;

/// How far apart two futures ever are.
double ApartM(const PredictedPath& a, const PredictedPath& b) {
  const size_t count = a.positions_map.size();
  const size_t step = 1 + (count - std::min(count, size_t{1})) / kComparedCount;
  double apart_m = 0.0;
  for (size_t back = 0; back < count; back += step) {
    const size_t i = count - 1 - back;
    apart_m = std::max(apart_m, (a.positions_map[i] - b.positions_map[i]).norm());
  }
  return apart_m;
}

/// How much probability is around a future, by how near the others are.
double WeightAround(size_t i, const std::vector<size_t>& others,
                    const std::vector<PredictedPath>& paths, const Eigen::MatrixXd& apart_m,
                    double merge_m) {
  const Eigen::Index row = static_cast<Eigen::Index>(i);
  double weight = 0.0;
  for (const size_t j : others) {
    const double way_m = apart_m(row, static_cast<Eigen::Index>(j));
    if (way_m < merge_m) weight += paths[j].probability * (1.0 - way_m / merge_m);
  }
  return weight;
}

}  // namespace

std::vector<PredictedPath> Merged(const std::vector<PredictedPath>& paths, double merge_m) {
  const Eigen::Index count = static_cast<Eigen::Index>(paths.size());
  Eigen::MatrixXd apart_m = Eigen::MatrixXd::Zero(count, count);
  for (size_t i = 0; i < paths.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double way_m = ApartM(paths[i], paths[j]);
      apart_m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = way_m;
      apart_m(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = way_m;
    }
  }
  std::vector<size_t> left(paths.size());
  std::iota(left.begin(), left.end(), size_t{0});
  std::vector<PredictedPath> merged;
  while (!left.empty()) {
    size_t best = left.front();
    double best_weight = -1.0;
    for (const size_t i : left) {
      const double weight = WeightAround(i, left, paths, apart_m, merge_m);
      if (weight <= best_weight) continue;
      best_weight = weight;
      best = i;
    }
    merged.push_back(paths[best]);
    merged.back().probability = 0.0;
    std::erase_if(left, [&](size_t i) {
      const double way_m = apart_m(static_cast<Eigen::Index>(best), static_cast<Eigen::Index>(i));
      if (i != best && way_m > merge_m) return false;
      merged.back().probability += paths[i].probability;
      return true;
    });
  }
  return merged;
}

}  // namespace dsg::query
