// SPDX-License-Identifier: Apache-2.0
// Points of paths in one line.
#pragma once

#include <cmath>

#include "query/prediction/velocity.h"

namespace dsg::query {

inline constexpr TimeNs kSecond = kNsPerSecond;

/// At the height of a torso.
inline PathPoint At(double seconds, double x_m, double y_m = 0.0) {
  return {static_cast<TimeNs>(std::llround(seconds * 1e9)), Eigen::Vector3d(x_m, y_m, 0.9)};
}

}  // namespace dsg::query
