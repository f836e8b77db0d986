// SPDX-License-Identifier: Apache-2.0
// How depth frames are made of pictures: all numbers that decide what is in one.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/depth/cloud_views.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Of RefineDisparity.
struct RefineOptions {
  /// Matches that a step is fitted to: this far beside the pixel, pixels.
  int reach_px = 4;
  /// Squared gradient, grey levels a pixel; less tells nothing.
  double slope_min = 1.0;
  /// A longer step leaves what was matched, pixels.
  double step_px_max = 0.75;
  /// How often; what is left is less than a hundredth of a pixel.
  int round_count = 2;
};

struct StereoOptions {
  /// Nothing nearer is looked for: each 16 columns of disparity cost as much again.
  double nearest_m = 0.4;
  /// Mean absolute gradient along the rows, grey levels a pixel, of what can be matched: over
  /// pixels this far beside it.
  double texture_min = 0.8;
  int texture_reach_px = 4;
  /// What is this near to the border of a picture is left out: windows across it would match its
  /// straight line.
  int border_px = 4;
  /// Blocks that are matched reach this far beside their pixel.
  int block_reach_px = 2;
  /// Of a disparity that differs from the next pixel's by one, and by more; grey levels for each
  /// pixel of the block.
  int step_penalty = 8;
  int jump_penalty = 32;
  /// Left and right match each other within this many pixels.
  int agree_px = 1;
  /// Gradients are cut at this, grey levels.
  int gradient_max = 31;
  /// The second best match costs so much more at least, per cent.
  int unique_percent = 10;
  /// Spots of fewer pixels, within which disparities differ by so many, are dropped.
  int speckle_px = 100;
  int speckle_step_px = 2;
  RefineOptions refine;
};

struct DepthOptions {
  /// Stereo is used when there is no depth channel, on pairs at least this far apart.
  TimeNs stereo_period_ns = 200'000'000;
  /// Stereo readings beyond are dropped; 0 = 5 m. Those of a depth camera are all kept: the space
  /// before them is free, which the map may want to know, and it has a range of its own.
  double range_m = 0.0;
  /// Class ids whose pixels move ("human", "person", "people" of the log's labels).
  std::vector<int32_t> dynamic_classes;
  /// Pixels that masks are grown by.
  int mask_growth_px = 3;
  /// Depth edges of more than this beside a mask belong to the mask, metres.
  double mask_edge_m = 0.3;
  /// Who is in a detection's box in which labels show nobody: what is this near to the torso. Of
  /// the torso, joints that are so visible. Nobody: this share of the box's pixels.
  double body_reach_m = 0.6;
  double joint_visibility_min = 0.3;
  double labelled_share_min = 0.02;
  /// Pictures this near in time belong to a depth picture, and those of a pair to each other.
  TimeNs tolerance_ns = 20'000'000;
  TimeNs pair_tolerance_ns = 2'000'000;
  /// Colour and labels of a camera that stands this near to the depth's are laid over it, and boxes
  /// of people that a camera this near has seen.
  double same_center_m = 0.005;
  double same_people_m = 0.06;
  StereoOptions stereo;
  /// Scans of lidars.
  CloudOptions cloud;

  /// Without those of lidars.
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
