// SPDX-License-Identifier: Apache-2.0
// A picture of one agent's bodies and skeletons over time, seen from the side of its way and a
// little from above. Colours say when.
#pragma once

#include <string>
#include <vector>

#include "query/cli/export/body.h"
#include "schema/picture/raster.h"

namespace dsg::cli {

struct BodyViewOptions {
  /// kTopViewWidthMin to kTopViewWidthMax. The height follows, at most twice the width and
  /// kTopViewWidthMax.
  int width_px = 1600;
  std::string title;
  /// The way is not drawn between bodies that are farther apart in time.
  TimeNs gap_ns = 2 * kNsPerSecond;
  /// Between skeletons, and between bodies, metres along the way: drawn closer they hide one
  /// another. The first and the last are drawn always.
  double skeleton_step_m = 0.15;
  double body_step_m = 1.0;
};

/// Skeletons of 24 joints in SMPL's order are drawn, others are not; bodies without faces neither.
/// Requires: at least one body, ascending in time.
picture::Picture DrawBodies(const std::vector<Body>& bodies, const BodyViewOptions& options);

}  // namespace dsg::cli
