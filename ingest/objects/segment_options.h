// SPDX-License-Identifier: Apache-2.0
// What takes the surface of a room without labels apart: all its constants in one place.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// How faces are found in the surface, and which of them are walls, floors and ceilings.
struct ShellOptions {
  double same_face_cosine = 0.8;
  double level_normal = 0.85;
  double upright_normal = 0.25;
  double grow_cosine = 0.94;
  double join_cosine = 0.98;
  double off_face_m = 0.06;
  double off_joined_m = 0.10;
  double face_m2_min = 0.05;

  double storey_m = 2.2;
  double upper_floor_share = 0.3;
  double slab_m = 0.4;
  int floor_squares = 3;
  int ceiling_squares = 4;

  double near_top_m = 0.3;
  double wall_end_m = 0.15;
  double across_share = 0.5;
  double across_cosine = 0.7;
  double room_m = 3.0;
  double behind_m = 0.25;
  int beside_columns = 8;
  double full_height_m = 0.35;
  double trim_share = 0.03;

  double bend_sine = 0.17;
  double up_normal = 0.8;
};

/// Units, ranges and reasons: the tables of the .cc file.
struct SegmentOptions {
  double cell_m = 0.05;

  double floor_skin_m = 0.06;
  double floor_drift_m = 0.15;
  double floor_area_m2 = 0.5;
  double ceiling_skin_m = 0.10;
  double ceiling_height_m = 1.9;
  double ceiling_area_m2 = 1.0;
  double slope_height_m = 1.2;

  double wall_skin_m = 0.08;
  double wall_depth_m = 0.15;
  double wall_area_m2 = 0.8;
  double wall_width_m = 0.6;
  double wall_gap_m = 1.2;
  double wall_reach_m = 1.7;
  double wall_top_gap_m = 0.4;
  double front_depth_m = 1.0;
  double front_share = 0.3;
  double front_width_m = 2.5;
  double column_share = 0.75;

  double patch_k = 0.6;
  double patch_area_m2 = 0.02;
  double convex_weight = 1.0;
  double flat_rad = 0.35;
  double side_reach_m = 0.15;
  double join_contact = 0.15;
  double concave_weight = 0.5;
  double inner_weight = 1.0;
  double side_share = 0.4;
  double seat_height_m = 0.6;
  double seat_low_m = 0.25;
  double table_width_m = 0.4;
  double table_area_m2 = 0.25;
  double under_share = 0.7;
  double under_gap_m = 0.3;
  double over_gap_m = 0.2;
  double over_area_m2 = 0.25;

  double size_max_m = 3.0;
  double size_min_m = 0.15;
  double area_min_m2 = 0.06;
  double height_min_m = 0.12;
  double sliver_m = 0.12;
  double strip_share = 0.25;
  double mount_m = 0.18;
  double shell_contact = 0.5;
  double reach_m = 2.3;
  double sheet_m = 0.2;
  double sheet_height_m = 1.9;

  ShellOptions shell;

  /// All numbers, for flags.
  std::vector<BoundOption> Bind();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds.
  absl::Status Validate() const;

  /// The values by name, as text; of the shell, those that differ from the defaults.
  std::string Digest() const;
};

}  // namespace dsg::ingest
