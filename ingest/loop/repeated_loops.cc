// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/repeated_loops.h"

#include <algorithm>
#include <map>
#include <utility>

#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

// Measurements of the same two poses that contradict each other: those after so many are not
// compared with, which bounds the time. No option.
constexpr size_t kContradictingMax = 16;

bool SaysTheSame(const RelativePose& loop, const RelativePose& other, double gate) {
  // Turned, so that both lead to the same pose. The noise of a turned loop is one of its first
  // pose, moved to the other end.
  Pose3d other_from_T_to = other.from_T_to;
  Matrix6d other_covariance = CovarianceOf(other, /*is_planar=*/false);
  if (other.from != loop.from) {
    other_covariance = MovedCovariance(AdjointOf(other.from_T_to), other_covariance);
    other_from_T_to = other.from_T_to.Inverse();
  }
  const Vector6d twist = LogOf(loop.from_T_to.Inverse() * other_from_T_to);
  const Matrix6d covariance = CovarianceOf(loop, /*is_planar=*/false) + other_covariance;
  return DeviationOf(twist, covariance, /*is_planar=*/false).squared <= gate;
}

}  // namespace

std::vector<bool> FindRepeated(const std::vector<RelativePose>& loops, double gate) {
  std::vector<bool> is_repeated(loops.size(), false);
  std::map<std::pair<int, int>, std::vector<size_t>> first_by_poses;
  for (size_t i = 0; i < loops.size(); ++i) {
    const RelativePose& loop = loops[i];
    std::vector<size_t>& first = first_by_poses[std::minmax(loop.from, loop.to)];
    is_repeated[i] = std::any_of(first.begin(), first.end(), [&](size_t other) {
      return SaysTheSame(loop, loops[other], gate);
    });
    if (!is_repeated[i] && first.size() < kContradictingMax) first.push_back(i);
  }
  return is_repeated;
}

}  // namespace dsg::ingest
