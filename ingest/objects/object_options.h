// SPDX-License-Identifier: Apache-2.0
// Labelled objects: all numbers that decide what of the mesh becomes one, and what becomes of it.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/objects/small_options.h"

namespace dsg::ingest {

/// Boxes around points. Units and reasons: the table of the .cc file.
struct BoxOptions {
  double trim_share = 0.01;
  double gain_min = 0.1;
};

/// Floors that objects stand on, by the mesh itself.
struct FloorLevelOptions {
  double bin_m = 0.05;
  double up_min = 0.8;
  double share_min = 0.2;
  double storey_m = 1.8;
  double step_m = 0.15;
};

/// Which pieces of the labelled mesh are one.
struct PieceOptions {
  int cell_count_min = 8;
  double dominant_share = 0.3;
  double nearly_share = 0.8;
  double split_share = 0.3;
  double interwoven_share = 0.35;
  double trim_share = 0.05;
  double join_gap_m = 0.5;
  double speck_share = 0.05;
  int speck_cell_count = 3;
  double echo_share = 0.2;
  double floor_reach_m = 0.25;
  double floor_skin_voxels = 0.6;
  double table_side_m = 0.4;
  double table_flatness = 0.4;
  double table_height_m = 1.2;
  FloorLevelOptions floors;
  BoxOptions box;
};

/// Which piece is which known object, and when a difference counts.
struct MatchOptions {
  double box_slack_m = 0.02;
  double instance_reach_m = 1.0;
  double overlap_min = 0.1;
  double center_reach_m = 0.15;
  double other_class_overlap_min = 0.4;
  double center_change_m = 0.02;
  double size_change_m = 0.05;
  double yaw_change_rad = 0.1;
  double own_point_m = 0.1;
  double same_point_m = 0.03;
  double own_share_min = 0.5;
  double same_share_min = 0.7;
  double seen_through_share = 0.5;
};

/// How objects lie to one another.
struct RelationOptions {
  double near_m = 0.5;
  double larger_min = 1.5;
  double contact_m = 0.12;
  double carried_share = 0.5;
  double edge_height_m = 0.3;
  double edge_gap_m = 0.25;
  double inside_share = 0.75;
  double inside_slack_m = 0.05;
  double container_min = 2.0;
};

/// Whether a thing is still where it was.
struct WatchOptions {
  double side_m_max = 0.6;
  int sample_count_max = 40;
  double inside_share = 0.4;
  double near_m = 0.4;
  double far_m = 5.0;
  double hidden_per_m = 0.015;
  double present_m = 0.3;
  double voted_share = 0.5;
  double present_share = 0.25;
  double absent_share = 0.9;
  int absent_run = 5;
  int present_run = 3;
  double residue_m = 0.1;
  int blind_px_max = 16;
  int blind_px_step = 2;
};

struct ObjectOptions {
  /// To the letter of RSS 2020: FindPaperObjects and ShapeOptions::is_paper, and nothing that
  /// pictures tell of small things.
  bool is_paper = false;
  PieceOptions pieces;
  MatchOptions match;
  RelationOptions relations;
  WatchOptions watch;
  SmallOptions small;

  /// Without those of small things.
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
