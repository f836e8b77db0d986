// SPDX-License-Identifier: Apache-2.0
// How structures and rooms are found: all numbers that change what is found. Units, ranges and
// reasons: room_options.cc.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

enum class RoomMethod {
  /// Both; the ceiling's where it could be seen, free space where not.
  kAuto,
  /// Horizontal section of free space just below the ceiling: doors have lintels.
  /// Source: RSS 2020, section IV-C.
  kCeiling,
  /// Free space at a person's height, cut at the narrow ways through its walls; no ceiling needed.
  /// Source: critical points of Voronoi graphs (Thrun, 1998; Bormann et al., 2016).
  kClearance,
  /// Parts of the place graph that stay apart while obstacles grow; see filtration.h.
  /// Source: Hughes et al., 2022.
  kFiltration,
  /// To the letter of RSS 2020, section IV-C: a section of the distance field 0.3 m below the
  /// ceiling, without what is nearer than 0.2 m to an obstacle; its pieces, and a vote over places.
  kPaper,
};

/// Horizontal sections of a storey (section.h).
struct SectionOptions {
  double ceiling_min_m = 2.25;
  double ceiling_m2_min = 2.0;
  double window_m = 1.5;
  double wide_window_m = 4.5;
  double vote_share = 0.125;
  double below_ceiling_m = 0.3;
  double step_count_max = 3.0;
  double above_doors_m = 2.15;
  double head_min_m = 1.4;
  double head_max_m = 1.95;
  double low_min_m = 0.3;
  double low_max_m = 1.35;
};

/// Ways through walls (wall_gaps.h).
struct WallGapOptions {
  double width_m_min = 0.4;
  double narrow_m_max = 1.3;
  double wide_m_max = 2.65;
  double behind_jamb_m = 0.25;
  double narrow_depth_m = 0.8;
  double wide_depth_m = 0.5;
  double opposite = 1.8;
  double apart_m = 0.5;
  double region_reach_m = 1.2;
  double hall_widths = 2.0;
  double arm_widths = 2.0;
  double arm_clearance = 0.6;
};

/// What stands in rooms and is no wall (furniture.h).
struct FurnitureOptions {
  double leg_m_max = 0.5;
  double apart_m = 0.1;
  double block_thick_m = 0.45;
  double block_long_m = 2.6;
  double block_filled = 0.6;
  double thin_m = 0.15;
  double deep_m = 1.0;
  double long_m = 3.0;
};

/// Bays that stand open to a corridor (open_rooms.h).
struct OpenRoomOptions {
  double sparse_max = 0.72;
  double compact_first = 0.93;
  double compact_min = 0.8;
  double bay_m2_min = 3.0;
  double bay_m2_max = 80.0;
  double depth_m_min = 1.2;
  double elongation_max = 2.2;
  double width_m_min = 0.8;
  double width_m_max = 6.0;
  double corner_reach_m = 0.5;
  double corner_share_min = 0.62;
  double end_share_min = 0.78;
  double open_share_max = 0.25;
  double large_m2 = 80.0;
  double corner_apart_m = 0.25;
  double same_opening_m = 0.5;
  double turn_deg = 16.0;
};

/// Nets of corridors (corridor_arms.h).
struct CorridorOptions {
  double width_m_max = 3.6;
  double net_slenderness = 6.0;
  double arm_slenderness = 2.0;
  double arm_m_min = 4.0;
  double junction_widths = 1.6;
  double straight_rad = 0.01;
};

/// Parts of the place graph (filtration.h).
struct FiltrationOptions {
  double clearance_m_min = 0.5;
  double clearance_m_max = 1.2;
  double place_count_min = 10.0;
};

struct RoomOptions {
  RoomMethod method = RoomMethod::kAuto;
  /// Nets of corridors are cut where their straight arms meet; false leaves them whole.
  bool split_corridors = true;

  double section_clearance_m = 0.2;
  double room_m2_min = 1.0;
  double clearance_room_m2_min = 1.6;
  double hole_m = 0.5;
  double body_hole_m = 0.3;
  double doorway_m = 0.6;
  double ceiling_seen_share = 0.5;
  double other_word_min = 0.05;
  double same_place_m = 0.75;

  SectionOptions section;
  FurnitureOptions furniture;
  WallGapOptions gaps;
  OpenRoomOptions open;
  CorridorOptions corridors;
  FiltrationOptions filtration;

  /// All numbers, for ValidateOptions, DigestOptions and flags.
  std::vector<BoundOption> Bind();
};

/// Walls, floors, ceilings and pillars, and which go on as which (structure.h, structure_rooms.h).
struct StructureOptions {
  double smooth_cosine = 0.8;
  double seed_cosine = 0.97;
  double grow_cosine = 0.9848;
  double off_plane_m = 0.1;
  double gap_m = 0.5;
  double crumb_m2 = 0.02;
  double broad_m2 = 0.02;
  double wall_m2_min = 0.3;
  double wall_lean_max = 0.7;
  double flat_m2_min = 0.5;
  double pillar_m2_min = 0.2;

  double level_cosine = 0.93;
  double upright_cosine = 0.2;
  double big_m2 = 2.0;
  double floor_level_m = 0.3;
  double ceiling_above_m = 2.0;
  double ceiling_below_m = 1.5;
  double wall_height_m = 1.5;
  double unlabelled_wall_m2 = 1.0;

  double same_height_m = 0.15;
  double near_m = 0.4;
  double along_m = 0.4;
  double along_share = 0.5;
  double over_m2 = 0.1;
  double hang_gap_m = 0.15;
  double hang_above_m = 0.3;

  double same_cosine = 0.966;
  double same_plane_m = 0.2;
  double same_apart_m = 0.3;

  /// All numbers, for ValidateOptions, DigestOptions and flags.
  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
