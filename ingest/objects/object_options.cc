// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<PieceOptions> kPieceFields[] = {
    {"object-cells", &PieceOptions::cell_count_min, 1, 1e6,
     "Least number of voxels of an object's surface; half of them if all have one instance: fewer "
     "are wrong labels"},
    {"object-dominant-share", &PieceOptions::dominant_share, 0.0, 1.0,
     "A piece has the instance of most of its voxels, if these are so many: less is noise"},
    {"object-nearly-share", &PieceOptions::nearly_share, 0.0, 1.0,
     "... or one with a lower number and nearly as many, so that it does not change back and "
     "forth"},
    {"object-split-share", &PieceOptions::split_share, 0.0, 0.5,
     "Pieces with two instances are two objects if the smaller has so much of both: less is a "
     "label that bleeds"},
    {"object-interwoven-share", &PieceOptions::interwoven_share, 0.0, 1.0,
     "... and no more of its box lies inside the other one's: one thing with two numbers"},
    {"object-instance-trim", &PieceOptions::trim_share, 0.0, 0.45,
     "Share of the voxels at either end of each axis that these boxes leave out: labels bleed"},
    {"object-join-gap", &PieceOptions::join_gap_m, 0.0, 10.0,
     "Pieces of one instance with less between them are one object, metres: what a person or a "
     "column hides"},
    {"object-speck-share", &PieceOptions::speck_share, 0.0, 1.0,
     "... but for pieces smaller than this share of the largest: specks"},
    {"object-speck-cells", &PieceOptions::speck_cell_count, 0, 1e6,
     "... and of fewer voxels than this: noise"},
    {"object-echo-share", &PieceOptions::echo_share, 0.0, 1.0,
     "Other pieces of the instance smaller than this share of it are no objects: its outline on "
     "what is behind"},
    {"object-floor-reach", &PieceOptions::floor_reach_m, 0.0, 5.0,
     "An object whose low side is this near to the floor stands on it, metres: voxels and what "
     "hides it cut it off"},
    {"object-floor-skin", &PieceOptions::floor_skin_voxels, 0.0, 10.0,
     "What is this near to the floor is left out of boxes, voxels: as likely the floor's, "
     "mislabelled"},
    {"object-table-side", &PieceOptions::table_side_m, 0.0, 10.0,
     "A slab this wide over the floor is a table, metres: its legs are too thin for the mesh"},
    {"object-table-flat", &PieceOptions::table_flatness, 0.0, 10.0,
     "... of at most this height, of its width: tops of tables are thin"},
    {"object-table-height", &PieceOptions::table_height_m, 0.0, 10.0,
     "... and at most this high over the floor, metres: higher ones are shelves on walls"},
};

constexpr OptionField<FloorLevelOptions> kLevelFields[] = {
    {"object-floor-bin", &FloorLevelOptions::bin_m, 0.005, 1.0,
     "Heights of floors are counted in bins of this, metres: noise and drift of a floor"},
    {"object-floor-up", &FloorLevelOptions::up_min, 0.0, 1.0,
     "What looks up is floor, least z of the normal: within 37 degrees"},
    {"object-floor-share", &FloorLevelOptions::share_min, 0.0, 1.0,
     "Least surface of a storey's floor, of the largest one's: less is a table of another class"},
    {"object-floor-apart", &FloorLevelOptions::storey_m, 0.1, 100.0,
     "Least height between two floors, metres: a storey"},
    {"object-floor-step", &FloorLevelOptions::step_m, 0.0, 5.0,
     "How far below its floor an object may seem to begin, metres: noise and drift"},
};

constexpr OptionField<BoxOptions> kBoxFields[] = {
    {"object-box-trim", &BoxOptions::trim_share, 0.0, 0.45,
     "Share of the surface at either end of each axis that a box leaves out: wrong points"},
    {"object-box-gain", &BoxOptions::gain_min, 0.0, 1.0,
     "A box is turned if its footprint gets smaller by this share: else it stays along the axes"},
};

constexpr OptionField<MatchOptions> kMatchFields[] = {
    {"object-slack", &MatchOptions::box_slack_m, 0.001, 1.0,
     "Boxes are compared with so much around them, metres: flat things get a volume"},
    {"object-instance-reach", &MatchOptions::instance_reach_m, 0.0, 100.0,
     "A piece of an object's instance is that object if it is this near, metres, besides half its "
     "size: numbers are given twice"},
    {"object-same-overlap", &MatchOptions::overlap_min, 0.0, 1.0,
     "... and one of its class if boxes share so much (intersection over union): objects grow "
     "while the map does"},
    {"object-same-center", &MatchOptions::center_reach_m, 0.0, 10.0,
     "... or middles are this near, metres: small ones whose boxes miss each other"},
    {"object-other-overlap", &MatchOptions::other_class_overlap_min, 0.0, 1.0,
     "... and one of another class if boxes share so much: its label has changed"},
    {"object-change-center", &MatchOptions::center_change_m, 0.0, 10.0,
     "An object is told anew when its middle moves by this, metres: each costs a row of the "
     "history"},
    {"object-change-size", &MatchOptions::size_change_m, 0.0, 10.0,
     "... or an edge changes by this, metres: a voxel"},
    {"object-change-yaw", &MatchOptions::yaw_change_rad, 0.0, 1.6, "... or it turns, radians"},
    {"object-own-point", &MatchOptions::own_point_m, 0.0, 10.0,
     "An object without a piece is one with another of its class that has points this near to "
     "its own, metres: two voxels"},
    {"object-same-point", &MatchOptions::same_point_m, 0.0, 10.0,
     "... or with one of another class, metres: the very same points"},
    {"object-own-share", &MatchOptions::own_share_min, 0.0, 1.0,
     "... for so much of its points: most of them"},
    {"object-same-share", &MatchOptions::same_share_min, 0.0, 1.0,
     "... of another class: more of them"},
    {"object-gone-share", &MatchOptions::seen_through_share, 0.0, 1.0,
     "An object without a piece is gone when more of its points lie in free space: most of them"},
};

constexpr OptionField<RelationOptions> kRelationFields[] = {
    {"relation-near", &RelationOptions::near_m, 0.0, 100.0,
     "Objects with less between their boxes are near each other, metres: an arm"},
    {"relation-larger", &RelationOptions::larger_min, 1.0, 1000.0,
     "... and one is larger if its volume is so many times the other's: boxes err by a half"},
    {"relation-contact", &RelationOptions::contact_m, 0.0, 5.0,
     "What stands on something is this near to its top, metres: voxels round both sides"},
    {"relation-carried", &RelationOptions::carried_share, 0.0, 1.0,
     "... with so much of its footprint above it: else it would fall"},
    {"relation-edge-height", &RelationOptions::edge_height_m, 0.0, 5.0,
     "... or, where nothing carries it so, what it touches the upper edge of, if that is so high, "
     "metres: of counters often the front alone is seen, and what stands on the floor beside "
     "something flat stands on nothing"},
    {"relation-edge-gap", &RelationOptions::edge_gap_m, 0.0, 5.0,
     "... or has beside it, this near, where it hangs on nothing either, metres: nothing floats, "
     "and "
     "of the tops of tables much is hidden or seen at a slant"},
    {"relation-inside", &RelationOptions::inside_share, 0.0, 1.0,
     "What is in something has so much of its volume in the box of it: most of it"},
    {"relation-inside-slack", &RelationOptions::inside_slack_m, 0.0, 5.0,
     "... which is this much larger, metres: a voxel"},
    {"relation-container", &RelationOptions::container_min, 1.0, 1000.0,
     "... and so many times as large: nothing lies in a thing of its own size"},
};

constexpr OptionField<WatchOptions> kWatchFields[] = {
    {"watch-side", &WatchOptions::side_m_max, 0.01, 10.0,
     "Longest side of things that are watched, metres: what a person carries about; the volume "
     "shows whether larger ones are gone"},
    {"watch-samples", &WatchOptions::sample_count_max, 1, 10000,
     "Points of a thing that a picture votes on, at most: more say the same"},
    {"watch-inside", &WatchOptions::inside_share, 0.0, 1.0,
     "How far from the middle to the surface these points lie: well inside the silhouette"},
    {"watch-near", &WatchOptions::near_m, 0.01, 100.0,
     "Pictures from this distance on vote, metres: nearer, depth cameras are blind"},
    {"watch-far", &WatchOptions::far_m, 0.1, 100.0,
     "... and up to this one, metres: farther, labels are wrong too often", "watch-near"},
    {"watch-hidden", &WatchOptions::hidden_per_m, 0.0, 1.0,
     "A reading nearer than the point by more hides it, metres a metre of distance: noise"},
    {"watch-present", &WatchOptions::present_m, 0.0, 10.0,
     "A thing of the class farther before or behind is another one, metres: small things are no "
     "deeper"},
    {"watch-voted", &WatchOptions::voted_share, 0.0, 1.0,
     "A picture counts if so much of the points have a vote: else it hardly saw the place"},
    {"watch-present-share", &WatchOptions::present_share, 0.0, 1.0,
     "... and shows the thing if so much of the votes do: labels are ragged"},
    {"watch-absent-share", &WatchOptions::absent_share, 0.0, 1.0,
     "... or its place without it: next to all"},
    {"watch-absent-run", &WatchOptions::absent_run, 1, 10000,
     "A thing has gone after so many pictures in a row without it: networks miss things"},
    {"watch-present-run", &WatchOptions::present_run, 1, 10000,
     "... and another one is there after so many with one: labels appear by chance"},
    {"watch-residue", &WatchOptions::residue_m, 0.0, 10.0,
     "Mesh of the class this near to where a thing has gone is left of it, metres: two voxels"},
    {"watch-blind", &WatchOptions::blind_px_max, 0, 1000,
     "How far from a pixel without a reading one of the same instance is looked for, pixels: depth "
     "cameras are blind beside edges, so where small things stand"},
    {"watch-blind-step", &WatchOptions::blind_px_step, 1, 1000,
     "... in steps of this, pixels: readings come in patches"},
};

}  // namespace

std::vector<BoundOption> ObjectOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PieceOptions>(kPieceFields, &pieces, &bound);
  BindFields<FloorLevelOptions>(kLevelFields, &pieces.floors, &bound);
  BindFields<BoxOptions>(kBoxFields, &pieces.box, &bound);
  BindFields<MatchOptions>(kMatchFields, &match, &bound);
  BindFields<RelationOptions>(kRelationFields, &relations, &bound);
  BindFields<WatchOptions>(kWatchFields, &watch, &bound);
  return bound;
}

}  // namespace dsg::ingest
