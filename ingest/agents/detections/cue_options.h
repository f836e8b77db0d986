// SPDX-License-Identifier: Apache-2.0
// How a detection is read: where it puts the body, and what floor and depth add. All its numbers.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// Where a detection alone puts the torso, and how sure that is. Units and reasons: the table of
/// the .cc file.
struct PlacementOptions {
  double fit_visibility_min = 0.05;
  double huber_px = 4.0;
  double noise_px_min = 1.0;
  double good_px = 8.0;
  double turn_rad_max = 0.8;

  double body_height_m = 1.7;
  double pelvis_share = 0.53;

  double ray_share = 0.12;
  double ray_m = 0.1;
  double box_ray_share = 0.2;
  double box_ray_m = 0.2;
  double lateral_share = 0.02;
  double lateral_m = 0.08;
  double hidden_lateral_m = 0.3;

  double pose_sigma_rad = 0.15;
  double joint_sigma_rad = 0.3;
  double hidden_sigma_rad = 0.3;
  double forward_min = 0.2;
};

/// What the floor says of a body.
struct FloorCueOptions {
  double visibility_min = 0.25;
  double border_px = 3.0;
  double camera_above_m = 0.2;
  double contact_px = 3.0;
  double contact_m = 0.05;
  double legs_m = 0.08;
  double hidden_legs_m = 0.25;
  double tip_m = 0.08;
  double sole_m = 0.055;
  double range_m_min = 0.4;
  double range_m_max = 20.0;
  double aspect_min = 2.0;
  double box_factor = 2.0;
  double pelvis_m_min = 0.15;
  double pelvis_m_max = 1.3;
  double skeleton_m = 0.05;
  double hidden_skeleton_m = 0.2;
  double head_top_m = 0.17;
  double stature_m = 0.08;
  double head_above_m = 0.2;
  double torso_height_m = 0.95;
  double torso_height_sigma_m = 0.15;
};

/// What a depth picture says of a body.
struct DepthCueOptions {
  int sample_count = 6000;
  double box_margin_px = 2.0;
  double same_picture_s = 0.02;
  double reach_m = 0.6;
  int pixel_count_min = 12;
  int patch_px = 2;

  int trunk_count_min = 10;
  double top_share = 0.97;
  double shoulders_m = 0.30;
  double pelvis_m = 0.85;
  double half_body_m = 0.11;
  double range_m = 0.045;
  double range_per_m2 = 0.001;
  double stereo_per_m2 = 0.015;
  double side_m = 0.035;
  double hidden_side_m = 0.12;
  double no_trunk_factor = 2.0;
  double no_label_factor = 1.5;
};

struct CueOptions {
  /// False: nothing beyond the detection, as in the paper.
  bool is_floor_used = true;
  bool is_depth_used = true;
  bool is_height_used = true;
  PlacementOptions placement;
  FloorCueOptions floor;
  DepthCueOptions depth;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
