// SPDX-License-Identifier: Apache-2.0
// How depth frames are made of pictures: all numbers that decide what is in one.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/depth/cloud_views.h"
#include "schema/base/time.h"

namespace dsg::ingest {

struct StereoOptions {
  /// Nothing nearer is looked for: each 16 columns of disparity cost as much again.
  double nearest_m = 0.4;
  /// Mean absolute gradient along the rows, grey levels a pixel, of what can be matched.
  double texture_min = 0.8;
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
