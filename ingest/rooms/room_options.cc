// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/room_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<RoomOptions> kRoomFields[] = {
    {"room-clearance", &RoomOptions::section_clearance_m, 0.0, 2.0,
     "Cells nearer to obstacles than this part rooms, metres: RSS 2020 has 0.2"},
    {"room-area", &RoomOptions::room_m2_min, 0.0, 100.0,
     "Least free area of a room, square metres: smaller ones are shafts and cupboards"},
    {"room-clearance-area", &RoomOptions::clearance_room_m2_min, 0.0, 100.0,
     "The same where no ceiling was seen, square metres: smaller ones are more likely corners "
     "between furniture"},
    {"room-hole", &RoomOptions::hole_m, 0.0, 5.0,
     "Holes up to this wide in what was seen below the ceiling are free space, metres: sight "
     "between lamps and beams leaves such"},
    {"room-body-hole", &RoomOptions::body_hole_m, 0.0, 5.0,
     "The same at a person's height, metres: less, since furniture hides more there"},
    {"room-doorway", &RoomOptions::doorway_m, 0.0, 5.0,
     "How far rooms grow into doorways and below what hangs from the ceiling, metres: half the "
     "depth of a deep doorway"},
    {"room-ceiling-seen", &RoomOptions::ceiling_seen_share, 0.0, 1.0,
     "The ceiling decides if it was seen over this share of the storey: over most of it"},
    {"room-other-word", &RoomOptions::other_word_min, 0.0, 1.0,
     "The other method's rooms are kept too if they differ on this share of the places: less is "
     "the rim of rooms"},
    {"room-same-place", &RoomOptions::same_place_m, 0.05, 10.0,
     "Rooms go on as those with places this near to theirs, metres: places move a little when the "
     "map is corrected"},
};

constexpr OptionField<SectionOptions> kSectionFields[] = {
    {"room-ceiling-height", &SectionOptions::ceiling_min_m, 1.0, 10.0,
     "Least height of a ceiling above the floor, metres: lower ones are lintels"},
    {"room-ceiling-area", &SectionOptions::ceiling_m2_min, 0.0, 100.0,
     "Least area that shares the height of a ceiling, square metres: beams and lamps have less"},
    {"room-ceiling-window", &SectionOptions::window_m, 0.1, 20.0,
     "Edge of the square around a column whose columns say its ceiling, metres: half a small room"},
    {"room-ceiling-wide-window", &SectionOptions::wide_window_m, 0.1, 60.0,
     "The same where nothing near was seen, metres: three times as wide"},
    {"room-ceiling-vote", &SectionOptions::vote_share, 0.0, 1.0,
     "Share of the square that has to have a ceiling's height: an eighth, since much is unseen"},
    {"room-below-ceiling", &SectionOptions::below_ceiling_m, 0.05, 2.0,
     "How far below the ceiling rooms are told apart, metres: RSS 2020 has 0.3"},
    {"room-below-ceiling-steps", &SectionOptions::step_count_max, 1.0, 20.0,
     "So many times as far below one looks where nothing was seen: three stay above doors"},
    {"room-above-doors", &SectionOptions::above_doors_m, 1.0, 10.0,
     "From this height above the floor walls go on over doors, metres: doors are 2.0 to 2.1 high"},
    {"room-head-low", &SectionOptions::head_min_m, 0.0, 5.0,
     "Lowest height above the floor of what parts rooms without a ceiling, metres: above tables, "
     "beds and chairs"},
    {"room-head-high", &SectionOptions::head_max_m, 0.0, 5.0,
     "Highest height of it, metres: below lintels", "room-head-low"},
    {"room-low-low", &SectionOptions::low_min_m, 0.0, 5.0,
     "Lowest height that counts where nothing was seen between those two, metres: above rugs and "
     "thresholds"},
    {"room-low-high", &SectionOptions::low_max_m, 0.0, 5.0,
     "Highest height of it, metres: just below the other two", "room-low-low"},
};

constexpr OptionField<WallGapOptions> kGapFields[] = {
    {"room-gap-width-min", &WallGapOptions::width_m_min, 0.0, 5.0,
     "Least width of a way through a wall, metres: nobody passes a narrower one"},
    {"room-gap-narrow", &WallGapOptions::narrow_m_max, 0.0, 10.0,
     "Up to this width it is enough that space opens at one end on either side, metres: single "
     "doors stand in corners"},
    {"room-gap-wide", &WallGapOptions::wide_m_max, 0.0, 10.0,
     "Greatest width, with wall at both ends, metres: double doors and passages"},
    {"room-gap-behind-jamb", &WallGapOptions::behind_jamb_m, 0.0, 5.0,
     "How far space must open behind a jamb, metres: less is noise of the wall"},
    {"room-gap-narrow-depth", &WallGapOptions::narrow_depth_m, 0.0, 5.0,
     "How far before and behind a narrow way one looks for that space, metres: thick walls"},
    {"room-gap-wide-depth", &WallGapOptions::wide_depth_m, 0.0, 5.0,
     "The same of a wide way, metres: less, or corridors count"},
    {"room-gap-opposite", &WallGapOptions::opposite, 1.0, 2.0,
     "Jambs are opposite if they are this many clearances apart: 2 is straight, 1.8 forgives "
     "cells"},
    {"room-gap-apart", &WallGapOptions::apart_m, 0.0, 5.0,
     "Least distance of the middles of two ways, metres: nearer ones are the same door"},
    {"room-gap-region-reach", &WallGapOptions::region_reach_m, 0.0, 10.0,
     "How far from a way's middle one looks for the rooms that it parts, metres: past a thick wall "
     "and the clearance"},
    {"room-mouth-hall", &WallGapOptions::hall_widths, 0.5, 100.0,
     "A corridor ends where walls are so many of its widths away: the hall is four times as wide"},
    {"room-mouth-arm", &WallGapOptions::arm_widths, 0.0, 100.0,
     "... if it goes on straight for so many of its widths: shorter ones are niches of the hall"},
    {"room-mouth-clearance", &WallGapOptions::arm_clearance, 0.5, 5.0,
     "... with walls no farther from its middle than this share of its width: half of it, and "
     "noise"},
};

constexpr OptionField<FurnitureOptions> kFurnitureFields[] = {
    {"room-leg", &FurnitureOptions::leg_m_max, 0.0, 5.0,
     "What stands alone and is no larger than this is no wall, metres: legs, bins, lamps"},
    {"room-leg-apart", &FurnitureOptions::apart_m, 0.0, 2.0,
     "What is nearer to something else does not stand alone, metres: walls that were seen in "
     "dashes"},
    {"room-block-thick", &FurnitureOptions::block_thick_m, 0.0, 10.0,
     "An obstacle that stands alone and is this thick is furniture or a pillar, metres: walls "
     "between rooms are thinner"},
    {"room-block-long", &FurnitureOptions::block_long_m, 0.0, 50.0,
     "... and no longer than this, metres: longer ones are pieces of wall"},
    {"room-block-filled", &FurnitureOptions::block_filled, 0.0, 1.0,
     "... and fills this share of its box: corners of walls between two doors do not"},
    {"room-furniture-thin", &FurnitureOptions::thin_m, 0.0, 5.0,
     "What stands in a corner or niche of a room's walls is furniture, unless it is thinner than "
     "this, metres: walls are as rough"},
    {"room-furniture-deep", &FurnitureOptions::deep_m, 0.0, 5.0,
     "... or deeper than this, metres: cupboards, desks and sofas"},
    {"room-furniture-long", &FurnitureOptions::long_m, 0.0, 10.0,
     "... or longer than this, metres: two cupboards side by side"},
};

constexpr OptionField<OpenRoomOptions> kOpenFields[] = {
    {"room-bay-sparse", &OpenRoomOptions::sparse_max, 0.0, 1.0,
     "What fills less of its convex hull has bays: corridors with what is open to them do, "
     "L-shaped rooms do not"},
    {"room-bay-compact-first", &OpenRoomOptions::compact_first, 0.0, 1.0,
     "Bays that fill this share of their hull are closed first: a room, and not a room with an "
     "end of the corridor"},
    {"room-bay-compact", &OpenRoomOptions::compact_min, 0.0, 1.0,
     "Least share of its hull that a bay fills: a room fills most of it"},
    {"room-bay-area-min", &OpenRoomOptions::bay_m2_min, 0.1, 1000.0,
     "Least area of a bay, square metres: smaller ones are niches"},
    {"room-bay-area-max", &OpenRoomOptions::bay_m2_max, 0.1, 10000.0,
     "Greatest area of a bay, square metres: larger ones are halls", "room-bay-area-min"},
    {"room-bay-depth", &OpenRoomOptions::depth_m_min, 0.0, 20.0,
     "How far a bay reaches behind its opening at least, metres: less is a niche"},
    {"room-bay-elongation", &OpenRoomOptions::elongation_max, 0.1, 100.0,
     "Greatest square of its depth over its area: more is an arm of the corridor"},
    {"room-bay-width-min", &OpenRoomOptions::width_m_min, 0.0, 20.0,
     "Least width of an opening, metres: narrower ones are doors"},
    {"room-bay-width-max", &OpenRoomOptions::width_m_max, 0.0, 20.0,
     "Greatest width of an opening, metres: the side of a room", "room-bay-width-min"},
    {"room-bay-corner-reach", &OpenRoomOptions::corner_reach_m, 0.05, 2.0,
     "Radius of the disc by which corners of walls are told, metres: more than a wall is thick"},
    {"room-bay-corner", &OpenRoomOptions::corner_share_min, 0.0, 1.0,
     "Free share of the disc at a corner: a straight wall leaves half, a corner three quarters"},
    {"room-bay-wall-end", &OpenRoomOptions::end_share_min, 0.0, 1.0,
     "Free share of the disc at the end of a wall between two spaces: more than a corner leaves"},
    {"room-bay-open-share", &OpenRoomOptions::open_share_max, 0.0, 1.0,
     "In a large compact region the opening is at most this share of the bay's rim: one side of "
     "four"},
    {"room-bay-large", &OpenRoomOptions::large_m2, 0.0, 100000.0,
     "From this area a compact region is divided at ends of walls, square metres: single rooms "
     "are smaller"},
    {"room-bay-corner-apart", &OpenRoomOptions::corner_apart_m, 0.0, 5.0,
     "Least distance of two corners, metres: the thickness of a wall"},
    {"room-bay-same", &OpenRoomOptions::same_opening_m, 0.0, 10.0,
     "Openings whose ends are this near to another's, summed, are the same, metres: the two "
     "corners of a wall's end"},
    {"room-bay-turn", &OpenRoomOptions::turn_deg, 2.0, 90.0,
     "An opening is shorter than lines turned by less than this about its corner, degrees: then "
     "it is straight across"},
};

constexpr OptionField<CorridorOptions> kCorridorFields[] = {
    {"room-corridor-width", &CorridorOptions::width_m_max, 0.5, 20.0,
     "Greatest width of a corridor, metres: wider ones are halls"},
    {"room-corridor-net", &CorridorOptions::net_slenderness, 1.0, 100.0,
     "Least length of a whole net of corridors, in widths: shorter ones are rooms"},
    {"room-corridor-arm", &CorridorOptions::arm_slenderness, 1.0, 100.0,
     "Least length of a straight arm, in widths: shorter ones are corners"},
    {"room-corridor-arm-length", &CorridorOptions::arm_m_min, 0.0, 100.0,
     "Least length of a straight arm, metres: shorter ones are doorways and lobbies"},
    {"room-corridor-junction", &CorridorOptions::junction_widths, 1.0, 10.0,
     "Arms meet where a cell sees so many widths both along and across: a side way adds at least "
     "half a width"},
    {"room-corridor-straight", &CorridorOptions::straight_rad, 0.0, 0.8,
     "Plans that lie aslant by less are not turned, radians: the arms stay true to a cell"},
};

constexpr OptionField<FiltrationOptions> kFiltrationFields[] = {
    {"room-filtration-min", &FiltrationOptions::clearance_m_min, 0.0, 10.0,
     "Obstacles grow from this, metres: half a door's width"},
    {"room-filtration-max", &FiltrationOptions::clearance_m_max, 0.0, 10.0,
     "... up to this, metres: half the width of a small room", "room-filtration-min"},
    {"room-filtration-places", &FiltrationOptions::place_count_min, 1.0, 1000.0,
     "Least number of places of a room: fewer are a corner"},
};

constexpr OptionField<StructureOptions> kStructureFields[] = {
    {"structure-smooth", &StructureOptions::smooth_cosine, -1.0, 1.0,
     "Normals are smoothed over neighbours within an angle of this cosine: 37 degrees keeps edges "
     "sharp"},
    {"structure-seed", &StructureOptions::seed_cosine, 0.0, 1.0,
     "Pieces begin where all neighbours look the same way, cosine: within 14 degrees"},
    {"structure-grow", &StructureOptions::grow_cosine, 0.0, 1.0,
     "... and grow over what looks the same way, cosine: within 10 degrees"},
    {"structure-off-plane", &StructureOptions::off_plane_m, 0.0, 1.0,
     "How far from its plane a piece reaches, metres: noise and drift of a wall"},
    {"structure-gap", &StructureOptions::gap_m, 0.0, 10.0,
     "Pieces of one plane with less between them are one, metres: pictures and pipes interrupt "
     "walls"},
    {"structure-crumb", &StructureOptions::crumb_m2, 0.0, 1.0,
     "Smaller pieces join nothing, square metres: noise"},
    {"structure-broad", &StructureOptions::broad_m2, 0.0, 10.0,
     "A plane is fitted if the piece varies by this along its narrow side, square metres: else "
     "the mean normal is the better word"},
    {"structure-wall-area", &StructureOptions::wall_m2_min, 0.0, 100.0,
     "Least area of a wall, square metres: smaller ones are frames"},
    {"structure-wall-lean", &StructureOptions::wall_lean_max, 0.0, 1.0,
     "What is labelled wall and faces up or down by more than this is none, cosine: labels bleed "
     "over the edges of floors, and walls of attics lean by up to 45 degrees"},
    {"structure-flat-area", &StructureOptions::flat_m2_min, 0.0, 100.0,
     "Least area of a floor or ceiling, square metres: smaller ones are steps and sills"},
    {"structure-pillar-area", &StructureOptions::pillar_m2_min, 0.0, 100.0,
     "Least area of a pillar, square metres: one side of a thin one"},
    {"structure-level", &StructureOptions::level_cosine, 0.0, 1.0,
     "Without labels: what looks up or down is level, cosine: within 22 degrees"},
    {"structure-upright", &StructureOptions::upright_cosine, 0.0, 1.0,
     "Without labels: what looks to the side is upright, greatest z of the normal: within 12 "
     "degrees"},
    {"structure-big", &StructureOptions::big_m2, 0.0, 1000.0,
     "Without labels: least area of pieces that say where floor and ceiling are, square metres: "
     "more than a table has"},
    {"structure-floor-level", &StructureOptions::floor_level_m, 0.0, 3.0,
     "Without labels: what is level and this near to the lowest is floor, metres: steps and drift"},
    {"structure-ceiling-above", &StructureOptions::ceiling_above_m, 0.0, 10.0,
     "Without labels: least height of a ceiling above the floor, metres: below are tables and "
     "shelves"},
    {"structure-ceiling-below", &StructureOptions::ceiling_below_m, 0.0, 10.0,
     "Without labels: how far below the highest ceiling others are, metres: rooms may be lower"},
    {"structure-wall-height", &StructureOptions::wall_height_m, 0.0, 10.0,
     "Without labels: least height of a wall, metres: furniture is lower"},
    {"structure-unlabelled-wall-area", &StructureOptions::unlabelled_wall_m2, 0.0, 100.0,
     "Without labels: least area of a wall, square metres: fronts of furniture have less"},
    {"structure-same-height", &StructureOptions::same_height_m, 0.0, 2.0,
     "Floors or ceilings within this height of each other are one, metres: less than a step"},
    {"structure-near", &StructureOptions::near_m, 0.05, 5.0,
     "A piece bounds a room whose outline is this near, metres: outlines end a little before "
     "walls"},
    {"structure-along", &StructureOptions::along_m, 0.0, 10.0,
     "... along at least this length, metres: a wall that runs along for less is another room's"},
    {"structure-along-share", &StructureOptions::along_share, 0.0, 1.0,
     "... or this share of a shorter wall: most of it"},
    {"structure-over", &StructureOptions::over_m2, 0.0, 100.0,
     "Least area that a floor or ceiling shares with its room, square metres: more than its rim"},
    {"structure-hang-gap", &StructureOptions::hang_gap_m, 0.0, 2.0,
     "What is this near to a wall, ceiling or pillar hangs on it, metres: boxes are rough by about "
     "a hand"},
    {"structure-hang-above", &StructureOptions::hang_above_m, 0.0, 5.0,
     "... if it is this high above the floor, metres: what is lower stands"},
    {"structure-same-angle", &StructureOptions::same_cosine, -1.0, 1.0,
     "A piece goes on as one whose normal is within an angle of this cosine: 15 degrees of drift"},
    {"structure-same-plane", &StructureOptions::same_plane_m, 0.0, 5.0,
     "... whose plane is this near to its middle, metres: less than two walls are apart"},
    {"structure-same-apart", &StructureOptions::same_apart_m, 0.0, 10.0,
     "... and whose box is this near, metres: pieces grow while the map does"},
};

}  // namespace

std::vector<BoundOption> RoomOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<RoomOptions>(kRoomFields, this, &bound);
  BindFields<SectionOptions>(kSectionFields, &section, &bound);
  BindFields<FurnitureOptions>(kFurnitureFields, &furniture, &bound);
  BindFields<WallGapOptions>(kGapFields, &gaps, &bound);
  BindFields<OpenRoomOptions>(kOpenFields, &open, &bound);
  BindFields<CorridorOptions>(kCorridorFields, &corridors, &bound);
  BindFields<FiltrationOptions>(kFiltrationFields, &filtration, &bound);
  return bound;
}

std::vector<BoundOption> StructureOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<StructureOptions>(kStructureFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
