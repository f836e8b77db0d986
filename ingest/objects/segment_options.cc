// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/segment_options.h"

#include "absl/strings/str_cat.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<SegmentOptions> kFields[] = {
    {"segment-cell", &SegmentOptions::cell_m, 0.02, 0.2,
     "Edge of the cells that the surface is thinned to, metres; the voxel if that is larger. Finer "
     "cells see the noise of depth cameras"},
    {"segment-floor-skin", &SegmentOptions::floor_skin_m, 0.0, 0.3,
     "What is this near to the floor is floor, metres: rugs, skirtings, rounded edges"},
    {"segment-floor-drift", &SegmentOptions::floor_drift_m, 0.0, 0.5,
     "How far a floor may be off its level, metres: drift, thresholds, ramps"},
    {"segment-floor-area", &SegmentOptions::floor_area_m2, 0.1, 100.0,
     "Least surface of a floor where the map has none, square metres"},
    {"segment-ceiling-skin", &SegmentOptions::ceiling_skin_m, 0.0, 0.5,
     "What is this near below the ceiling is ceiling, metres"},
    {"segment-ceiling-height", &SegmentOptions::ceiling_height_m, 1.0, 10.0,
     "Least height of a ceiling above the floor, metres"},
    {"segment-ceiling-area", &SegmentOptions::ceiling_area_m2, 0.1, 100.0,
     "Least surface of a ceiling, square metres"},
    {"segment-slope-height", &SegmentOptions::slope_height_m, 0.0, 10.0,
     "An oblique face as large as a ceiling and on the average this high above the floor is a "
     "roof's, "
     "metres"},
    {"segment-wall-skin", &SegmentOptions::wall_skin_m, 0.0, 0.3,
     "What is this near before a wall is wall, metres: pictures, switches, frames"},
    {"segment-wall-depth", &SegmentOptions::wall_depth_m, 0.0, 1.0,
     "How far behind its face a wall is solid, metres"},
    {"segment-wall-area", &SegmentOptions::wall_area_m2, 0.1, 100.0,
     "Least surface of a wall, square metres"},
    {"segment-wall-width", &SegmentOptions::wall_width_m, 0.1, 10.0,
     "Least width of a wall, metres"},
    {"segment-wall-gap", &SegmentOptions::wall_gap_m, 0.0, 10.0,
     "How wide furniture and doors may interrupt a wall, metres"},
    {"segment-wall-reach", &SegmentOptions::wall_reach_m, 0.5, 10.0,
     "How high above the floor a wall reaches where no ceiling is seen, metres; lower where "
     "nothing "
     "is seen up there"},
    {"segment-wall-top-gap", &SegmentOptions::wall_top_gap_m, 0.0, 3.0,
     "How near below the ceiling a wall reaches where a ceiling is seen, metres"},
    {"segment-front-depth", &SegmentOptions::front_depth_m, 0.0, 3.0,
     "An upright face is a cupboard's if another one stands within this behind it, metres"},
    {"segment-front-share", &SegmentOptions::front_share, 0.0, 1.0,
     "... along this share of its width, or beside it"},
    {"segment-front-width", &SegmentOptions::front_width_m, 0.0, 10.0,
     "... beside it counts for faces of up to this width, metres"},
    {"segment-column-share", &SegmentOptions::column_share, 0.1, 1.0,
     "What fills this share of the height up to the ceiling is wall or pillar"},
    {"segment-patch-k", &SegmentOptions::patch_k, 0.01, 100.0,
     "Constant k of the over-segmentation; larger makes larger patches"},
    {"segment-patch-area", &SegmentOptions::patch_area_m2, 0.0, 1.0,
     "Smaller patches join the neighbour that is most like them, square metres"},
    {"segment-convex-weight", &SegmentOptions::convex_weight, 0.0, 1.0,
     "What an edge that bends outwards counts in the over-segmentation, of one that bends inwards"},
    {"segment-flat", &SegmentOptions::flat_rad, 0.0, 1.5,
     "Patches that look nearly the same way go on into each other, radians"},
    {"segment-side-reach", &SegmentOptions::side_reach_m, 0.0, 1.0,
     "How far around a contact patches are looked at, whether they bend there, metres"},
    {"segment-join-contact", &SegmentOptions::join_contact, 0.0, 10.0,
     "Two things are one if they touch along this much of their outlines, of the root of the "
     "smaller one's area"},
    {"segment-concave-weight", &SegmentOptions::concave_weight, 0.0, 10.0,
     "What a contact that bends inwards counts against that, of its length"},
    {"segment-inner-weight", &SegmentOptions::inner_weight, 0.0, 10.0,
     "What it counts for that if it is a whole side of both: backs and seats"},
    {"segment-side-share", &SegmentOptions::side_share, 0.0, 10.0,
     "... that is, this share of their widths"},
    {"segment-seat-height", &SegmentOptions::seat_height_m, 0.0, 2.0,
     "What rises from a level surface higher than this above the floor stands on it, metres; lower "
     "ones are seats and beds"},
    {"segment-seat-low", &SegmentOptions::seat_low_m, 0.0, 2.0,
     "A level surface from this height on is a seat of what stands below a table, metres: lower "
     "ones are feet"},
    {"segment-table-width", &SegmentOptions::table_width_m, 0.0, 3.0,
     "... if it is this wide: shelves are not, metres"},
    {"segment-table-area", &SegmentOptions::table_area_m2, 0.0, 10.0,
     "... and this large, square metres"},
    {"segment-under-share", &SegmentOptions::under_share, 0.0, 1.0,
     "What lies below a larger thing with this share of its footprint is a part of it: legs"},
    {"segment-under-gap", &SegmentOptions::under_gap_m, 0.0, 2.0,
     "... if no more than this is between them, metres"},
    {"segment-over-gap", &SegmentOptions::over_gap_m, 0.0, 2.0,
     "What lies above a larger thing that is no table is a part of it, if no more than this is "
     "between them, metres"},
    {"segment-over-area", &SegmentOptions::over_area_m2, 0.0, 10.0,
     "... and its surface is no larger: backs of chairs, square metres"},
    {"segment-size-max", &SegmentOptions::size_max_m, 0.5, 20.0, "Longest side of a box, metres",
     "segment-size-min"},
    {"segment-size-min", &SegmentOptions::size_min_m, 0.0, 2.0,
     "What is smaller on all sides is no object, metres"},
    {"segment-area-min", &SegmentOptions::area_min_m2, 0.0, 10.0,
     "Least surface of an object, square metres"},
    {"segment-height-min", &SegmentOptions::height_min_m, 0.0, 2.0,
     "What rises less above the floor, and hangs less below the ceiling, is no object, metres"},
    {"segment-sliver", &SegmentOptions::sliver_m, 0.0, 1.0,
     "What is thinner on two sides is no object, metres"},
    {"segment-strip-share", &SegmentOptions::strip_share, 0.0, 1.0,
     "What is thinner on one side is none if it is this narrow for its length: frames of doors"},
    {"segment-mount", &SegmentOptions::mount_m, 0.0, 1.0,
     "What sticks out from a wall by less is a part of it, metres"},
    {"segment-reach", &SegmentOptions::reach_m, 0.5, 20.0,
     "What begins higher above the floor is a part of the building, metres"},
    {"segment-sheet", &SegmentOptions::sheet_m, 0.0, 1.0,
     "What is thinner and stands upright on the floor is a door or a piece of wall, metres"},
    {"segment-sheet-height", &SegmentOptions::sheet_height_m, 0.5, 10.0,
     "... if it is this high, metres: refrigerators are lower, doors are not"},
    {"segment-shell-contact", &SegmentOptions::shell_contact, 0.0, 1.0,
     "What touches walls and ceilings with this share of its surface is a remnant of them"},
};

constexpr OptionField<ShellOptions> kShellFields[] = {
    {"segment-same-face", &ShellOptions::same_face_cosine, -1.0, 1.0,
     "Normals are smoothed over neighbours within an angle of this cosine: 37 degrees keeps edges "
     "sharp"},
    {"segment-level", &ShellOptions::level_normal, 0.0, 1.0,
     "What looks up or down is level, least z of the normal: within 32 degrees, noise of cells"},
    {"segment-upright", &ShellOptions::upright_normal, 0.0, 1.0,
     "What looks to the side is upright, greatest z of the normal: within 14 degrees"},
    {"segment-grow", &ShellOptions::grow_cosine, 0.0, 1.0,
     "An upright face goes on over cells that look as it does, cosine: within 20 degrees"},
    {"segment-join", &ShellOptions::join_cosine, 0.0, 1.0,
     "... and over other faces, cosine: within 11 degrees, since they are surer"},
    {"segment-off-face", &ShellOptions::off_face_m, 0.0, 1.0,
     "How far from a face its cells are, metres: noise of a cell"},
    {"segment-off-joined", &ShellOptions::off_joined_m, 0.0, 1.0,
     "... and other faces that it goes on in, metres: drift along a wall"},
    {"segment-face-area", &ShellOptions::face_m2_min, 0.0, 10.0,
     "Smaller faces are none, square metres: twenty cells"},
    {"segment-storey", &ShellOptions::storey_m, 0.5, 20.0,
     "Least height between two floors where the map has none, metres: a storey"},
    {"segment-upper-floor", &ShellOptions::upper_floor_share, 0.0, 1.0,
     "Least surface of an upper floor, of the largest below: less is a shelf or a landing"},
    {"segment-slab", &ShellOptions::slab_m, 0.0, 5.0,
     "What is this far above a ceiling is of another storey, metres: slabs are at least as thick"},
    {"segment-floor-squares", &ShellOptions::floor_squares, 0, 100,
     "How far around a place its floor is looked for, squares of 0.25 metres: below a table"},
    {"segment-ceiling-squares", &ShellOptions::ceiling_squares, 0, 100,
     "How far a ceiling goes on beyond what is seen of it, squares of 0.25 metres: lamps hide it"},
    {"segment-near-top", &ShellOptions::near_top_m, 0.0, 5.0,
     "Where no ceiling is seen, a wall reaches this near to the highest that is, metres: cameras "
     "look at the top of some walls only"},
    {"segment-wall-end", &ShellOptions::wall_end_m, 0.0, 5.0,
     "A wall goes this far beyond what is seen of it, metres: corners are rounded off"},
    {"segment-across-share", &ShellOptions::across_share, 0.0, 1.0,
     "What is no part of a wall's face belongs to it up to this share of its skin: sides of things "
     "that stand at it"},
    {"segment-across", &ShellOptions::across_cosine, 0.0, 1.0,
     "... which is what looks another way, cosine: by more than 45 degrees"},
    {"segment-room", &ShellOptions::room_m, 0.1, 100.0,
     "Where nobody knows which side of a wall was seen, what is this near to it says so, metres: a "
     "small room"},
    {"segment-behind", &ShellOptions::behind_m, 0.0, 5.0,
     "A face behind a front begins this far behind it, metres: the least depth of a cupboard"},
    {"segment-beside", &ShellOptions::beside_columns, 1, 1000,
     "How far beside a front the wall behind it is looked for, columns of 0.1 metres: cupboards in "
     "a row"},
    {"segment-full-height", &ShellOptions::full_height_m, 0.0, 5.0,
     "What reaches this near to floor and ceiling is a part of the building, metres: skirtings "
     "hide the rest"},
    {"segment-trim", &ShellOptions::trim_share, 0.0, 0.45,
     "Share of the cells at either end of an extent that is left out: smear"},
    {"segment-bend", &ShellOptions::bend_sine, 0.0, 1.0,
     "A bend between patches of less counts as none, sine: 10 degrees, noise of normals"},
    {"segment-up", &ShellOptions::up_normal, 0.0, 1.0,
     "Patches that look up are seats and tables, least z of the normal: within 37 degrees"},
};

}  // namespace

std::vector<BoundOption> SegmentOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<SegmentOptions>(kFields, this, &bound);
  BindFields<ShellOptions>(kShellFields, &shell, &bound);
  return bound;
}

absl::Status SegmentOptions::Validate() const { return ValidateOptions(*this); }

std::string SegmentOptions::Digest() const {
  SegmentOptions options = *this;
  std::vector<BoundOption> own;
  BindFields<SegmentOptions>(kFields, &options, &own);
  std::vector<BoundOption> faces;
  BindFields<ShellOptions>(kShellFields, &options.shell, &faces);
  ShellOptions defaults;
  std::vector<BoundOption> usual;
  BindFields<ShellOptions>(kShellFields, &defaults, &usual);
  const std::string tuning = DigestFields(faces, usual);
  return absl::StrCat(DigestFields(own, {}), tuning.empty() ? "" : " ", tuning);
}

}  // namespace dsg::ingest
