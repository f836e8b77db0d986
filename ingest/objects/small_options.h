// SPDX-License-Identifier: Apache-2.0
// Small things and things in hands: all numbers that decide what of pictures becomes one.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// What one picture shows of a thing. Units and reasons: the table of the .cc file.
struct SightingOptions {
  int pixel_count_min = 12;
  int reading_count_min = 6;
  int reading_count_max = 1500;
  int point_count_max = 64;
  double read_share_min = 0.15;
  double near_m = 0.3;
  double far_m = 6.0;

  double noise_m = 0.0025;
  double noise_per_m2 = 0.002;
  double stereo_noise_per_m2 = 0.01;
  double depth_bin_m = 0.02;
  double rare_share = 0.2;
  double trim_share = 0.04;
  double high_min = 0.3;
  double outline_px = 2.0;
  double back_share = 0.12;

  int border_px = 3;
  double before_m = 0.05;
  double above_foot_m = 0.03;
  double hidden_share_max = 0.12;
  double scattered_share_max = 0.25;
  double hand_m = 0.3;
  double held_share_min = 0.08;
};

/// What pictures together show.
struct SmallThingOptions {
  double gate = 11.3;
  double gate_m = 0.3;
  double stand_m = 0.02;
  int whole_count_min = 4;
  TimeNs span_min_ns = kNsPerSecond;
  double viewpoints_m = 0.15;
  double seen_share_min = 0.3;
  double large_share_max = 0.15;
  int sighting_count_min = 8;
  TimeNs forget_ns = 60 * kNsPerSecond;
  double apart_share = 0.15;
  double same_m = 0.08;
  double overlap_m = 0.08;
  double miss_near_m = 0.5;
  double miss_far_m = 4.0;
  double hidden_m = 0.05;
  int miss_border_px = 15;
  double off_weight = 20.0;
};

/// Things on their way in a hand.
struct CarryOptions {
  TimeNs gap_ns_max = 2 * kNsPerSecond;
  double speed_mps_max = 2.0;
  double reach_m = 0.3;
  int point_count_min = 4;
  double way_m_min = 0.5;
};

struct SmallOptions {
  /// What a person carries in a hand, with what a label adds at the outline.
  double span_m = 0.33;
  SightingOptions sighting;
  SmallThingOptions thing;
  CarryOptions carry;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
