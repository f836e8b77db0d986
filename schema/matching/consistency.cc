// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/consistency.h"

#include <algorithm>
#include <vector>

#include "schema/matching/adaptive_voting.h"

namespace dsg {
namespace {

// Two million intervals take half a second and 50 MB.
constexpr int64_t kScalePairCountMax = 1'000'000;

using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
using Flags = Eigen::Array<bool, 1, Eigen::Dynamic>;

Row Lengths(const Columns& differences, bool is_horizontal) {
  return differences.topRows(is_horizontal ? 2 : 3).colwise().norm().array();
}

// Whether the last correspondence that was looked at agrees with each of those after it.
Flags AgreesWithLater(const Columns& sources, const Columns& targets, int first,
                      const ConsistencyOptions& options) {
  const Eigen::Index count = sources.cols() - first - 1;
  const Columns a = sources.rightCols(count).colwise() - sources.col(first);
  const Columns b = targets.rightCols(count).colwise() - targets.col(first);
  const double bound = 2.0 * options.noise_bound_m;
  Flags agrees = (Lengths(a, options.is_upright) - Lengths(b, options.is_upright)).abs() <= bound;
  if (options.is_upright) agrees = agrees && (a.row(2) - b.row(2)).array().abs() <= bound;
  // A point has one partner, and points at one place count as one point.
  return agrees && a.colwise().squaredNorm().array() > 0.0 &&
         b.colwise().squaredNorm().array() > 0.0;
}

}  // namespace

BitsetGraph MakeConsistencyGraph(const Columns& sources, const Columns& targets,
                                 const ConsistencyOptions& options) {
  const int count = static_cast<int>(sources.cols());
  BitsetGraph graph(count);
  for (int i = 0; i + 1 < count; ++i) {
    const Flags agrees = AgreesWithLater(sources, targets, i, options);
    for (int j = i + 1; j < count; ++j) {
      if (agrees(j - i - 1)) graph.AddEdge(i, j);
    }
  }
  return graph;
}

double VoteOnScale(const Columns& sources, const Columns& targets, double noise_bound_m) {
  const int64_t count = sources.cols();
  const int64_t pair_count = count * (count - 1) / 2;
  const int64_t stride = std::max<int64_t>(1, pair_count / kScalePairCountMax);
  std::vector<Measurement> ratios;
  int64_t pair = 0;
  for (int64_t i = 0; i < count; ++i) {
    for (int64_t j = i + 1; j < count; ++j) {
      if (pair++ % stride != 0) continue;
      const double from = (sources.col(j) - sources.col(i)).norm();
      const double to = (targets.col(j) - targets.col(i)).norm();
      if (from <= 0.0 || to <= 0.0) continue;
      ratios.push_back({to / from, 2.0 * noise_bound_m / from});
    }
  }
  return ratios.empty() ? 1.0 : VoteAdaptively(ratios).value;
}

}  // namespace dsg
