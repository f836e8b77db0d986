// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/objects/registration/feature_match.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Cubes counted from the origin along each axis.
constexpr double kCubeIndexMax = 1e9;

using Cube = std::array<int64_t, 3>;

}  // namespace

absl::StatusOr<std::vector<Eigen::Vector3d>> ThinCloud(const std::vector<Eigen::Vector3d>& cloud,
                                                       double spacing_m) {
  if (!std::isfinite(spacing_m) || spacing_m <= 0.0) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("thinning: spacing ", spacing_m, " m; give one above 0"),
                     {{"field", "spacing_m"}});
  }
  std::vector<std::pair<Cube, size_t>> cubes;
  for (size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud[i].allFinite()) continue;
    const Eigen::Vector3d index = cloud[i] / spacing_m;
    if (index.cwiseAbs().maxCoeff() > kCubeIndexMax) {
      return MakeError(
          Reason::kFieldInvalid,
          absl::StrCat("thinning: point ", i, " lies more than ", kCubeIndexMax, " cubes of ",
                       spacing_m, " m from the origin; check the units of the cloud"),
          {{"field", "cloud"}, {"index", absl::StrCat(i)}});
    }
    Cube cube;
    for (int axis = 0; axis < 3; ++axis) {
      cube[axis] = static_cast<int64_t>(std::floor(index(axis)));
    }
    cubes.emplace_back(cube, i);
  }
  std::sort(cubes.begin(), cubes.end());
  std::vector<Eigen::Vector3d> thinned;
  for (size_t begin = 0; begin < cubes.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    size_t end = begin;
    for (; end < cubes.size() && cubes[end].first == cubes[begin].first; ++end) {
      sum += cloud[cubes[end].second];
    }
    thinned.push_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
  return thinned;
}

}  // namespace dsg::ingest
