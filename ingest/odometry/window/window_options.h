// SPDX-License-Identifier: Apache-2.0
// The numbers of the window of keyframes.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

struct WindowOptions {
  /// Keyframes that are estimated together; older ones become a prior.
  int keyframe_count = 12;
  /// Steps of the solver after each keyframe.
  int step_count = 6;
  /// Standard deviations of a feature's place and of its disparity, pixels.
  double pixel_sigma_px = 1.0;
  double disparity_sigma_px = 1.0;
  /// How wrong the calibration may be, one standard deviation: all disparities, pixels, the
  /// baseline, a share of it, and the stamps of images on the clock of the unit, seconds.
  double disparity_offset_px = 1.0;
  double baseline_share = 0.002;
  double clock_s = 0.005;
  /// From here on a miss costs its size instead of its square, standard deviations.
  double huber_sigmas = 1.5;
  /// Landmarks that miss the images they were seen in by more, on average, are dropped, pixels.
  double miss_px_max = 3.0;
  /// Between the rays to a landmark that no pair of images measures, degrees.
  double parallax_deg_min = 1.5;
  /// Distances of landmarks along the optical axis, metres.
  double nearest_m = 0.2;
  double farthest_m = 60.0;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
