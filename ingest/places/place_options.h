// SPDX-License-Identifier: Apache-2.0
// How places are found: all numbers that change what is found. Units, ranges and reasons:
// place_options.cc.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

enum class PlaceMode {
  /// For robots on wheels and for people: obstacles are those within the height of a body, and
  /// places lie on the floor.
  kGround,
  /// For things that fly: the whole volume.
  kVolume,
};

struct PlaceOptions {
  PlaceMode mode = PlaceMode::kGround;
  /// 0.05 to 2 m; not in the table, since it has a flag among the first.
  double robot_radius_m = 0.25;
  /// Heights of the floors, ascending; empty = found from the grid.
  std::vector<double> floors_m;

  // Floors (find_floors.cc).
  double storey_m_min = 2.0;
  double headroom_m = 1.5;
  double headroom_seen_share = 0.5;
  double floor_m2_min = 1.0;
  double floor_share_min = 0.05;
  double floor_layer_share = 0.05;
  double below_floor_m = 0.3;

  // What a body on a floor sees of the volume (project_to_floor.cc).
  double body_z_min_m = 0.1;
  double body_z_max_m = 1.8;
  double body_seen_share = 0.5;
  double layer_cut = 0.3;
  double board_column_count = 6.0;
  double hole_depth_m = 0.4;

  // The robot's own path (extract_places.cc, space_grid.cc).
  double path_height_m = 2.5;
  double wheels_m = 0.1;
  double wheels_share = 0.95;
  double footprint_m = 0.3;

  // The Voronoi diagram (voronoi_places.cc).
  double block_m = 1.5;
  double merge_m = 0.7;
  double basis_cosine = 0.5;
  double basis_radii = 2.0;

  // Covering the space (cover_space.cc).
  double path_reach_m = 2.0;
  double step_m = 0.2;
  double reach_m = 1.5;
  double near_reach_m = 0.6;
  double reach_rise = 0.3;
  double volume_step_m = 0.4;
  double volume_reach_m = 2.0;
  double corner_reach_m = 2.5;

  // Links (link_places.cc, ways.cc, connect_places.cc, shortcuts.cc, thin_out.cc).
  double link_m = 3.5;
  double link_apart_cosine = 0.866;
  double link_count_max = 12.0;
  double way_m = 4.0;
  double bend_m = 0.5;
  double narrow_weight = 1.0;
  double detour = 1.1;
  double heir_m = 0.45;

  // Ways between floors (storey_links.cc).
  double landing_m = 0.4;
  double lift_run_m = 1.0;
  double ramp_slope = 0.3;

  // What is free around a place (free_box.cc).
  double free_box_m = 5.0;

  // Which place goes on as which, and what is in sight of one (place_tracker.cc).
  double same_m = 0.5;
  double sight_place_count = 16.0;
  double sight_forgiven_m = 0.4;
  double eye_low_m = 0.9;
  double eye_high_m = 1.5;
  double above_furniture_m = 1.9;

  /// All numbers, for ValidateOptions, DigestOptions and flags.
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
