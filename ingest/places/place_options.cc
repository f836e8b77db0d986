// SPDX-License-Identifier: Apache-2.0
#include "ingest/places/place_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<PlaceOptions> kFields[] = {
    {"place-storey", &PlaceOptions::storey_m_min, 0.5, 20.0,
     "Least height between two floors, metres: nearer levels are tables and stairs"},
    {"place-headroom", &PlaceOptions::headroom_m, 0.1, 10.0,
     "Least height without an obstacle above a floor, metres: more than under a table"},
    {"place-headroom-seen", &PlaceOptions::headroom_seen_share, 0.0, 1.0,
     "Share of it that has to be seen free: half, since cameras miss much overhead"},
    {"place-floor-area", &PlaceOptions::floor_m2_min, 0.0, 100.0,
     "Least area of a floor, square metres: smaller ones are landings"},
    {"place-floor-share", &PlaceOptions::floor_share_min, 0.0, 1.0,
     "Least area of a floor, of the largest one's: smaller ones are tops of furniture"},
    {"place-floor-layer", &PlaceOptions::floor_layer_share, 0.0, 1.0,
     "The next layer of cells belongs to a floor if it has this share of its area: noise lifts "
     "parts of a floor"},
    {"place-below-floor", &PlaceOptions::below_floor_m, 0.0, 2.0,
     "How far below a floor the robot's path counts as on it, metres: drift and ramps"},
    {"place-body-low", &PlaceOptions::body_z_min_m, 0.0, 2.0,
     "Height above the floor from which obstacles count, metres: above rugs and thresholds"},
    {"place-body-high", &PlaceOptions::body_z_max_m, 0.1, 5.0,
     "Height above the floor up to which obstacles count, metres: that of a person",
     "place-body-low"},
    {"place-body-seen", &PlaceOptions::body_seen_share, 0.0, 1.0,
     "Share of a body's height, and of its lower half, that has to be seen free: half, so that "
     "what stands behind a sofa counts"},
    {"place-layer-cut", &PlaceOptions::layer_cut, 0.0, 1.0,
     "A layer of cells is below a height if more than this share of it is: the noise of a floor "
     "must not stand in the way"},
    {"place-board-columns", &PlaceOptions::board_column_count, 1.0, 10.0,
     "Columns of nine with a gap between free cells that make it a thin board: most, or it is "
     "chance; 10 = boards are not looked for"},
    {"place-hole-depth", &PlaceOptions::hole_depth_m, 0.05, 5.0,
     "How far one must see down through a floor to take it for a hole, metres: two steps of a "
     "stair"},
    {"place-path-height", &PlaceOptions::path_height_m, 0.1, 20.0,
     "Greatest height of the robot's sensors above its floor, metres: below the next floor"},
    {"place-wheels", &PlaceOptions::wheels_m, 0.0, 2.0,
     "A robot whose height varies by less stands on wheels and its path is free, metres: a camera "
     "in a hand passes over tables"},
    {"place-wheels-share", &PlaceOptions::wheels_share, 0.0, 1.0,
     "... on this share of its path: some poses are wrong"},
    {"place-footprint", &PlaceOptions::footprint_m, 0.0, 2.0,
     "Radius around such a path that is free, metres: a robot's body"},
    {"place-block", &PlaceOptions::block_m, 0.2, 20.0,
     "Edge of the blocks with one place for each part of the Voronoi diagram, metres: places "
     "about as far apart as a person reaches"},
    {"place-merge", &PlaceOptions::merge_m, 0.0, 20.0,
     "Places of the diagram nearer to each other are one, metres: half a block"},
    {"place-basis", &PlaceOptions::basis_cosine, -1.0, 1.0,
     "Two obstacles are two if they are seen at an angle of this cosine at least: 60 degrees"},
    {"place-basis-apart", &PlaceOptions::basis_radii, 0.0, 20.0,
     "... and are so many robot's radii apart: it passes between them"},
    {"place-path-reach", &PlaceOptions::path_reach_m, 0.1, 20.0,
     "The robot's path has a place in sight within this, metres: it was there"},
    {"place-step", &PlaceOptions::step_m, 0.05, 5.0,
     "Distance of the spots that have to be covered by places, metres: half a robot"},
    {"place-reach", &PlaceOptions::reach_m, 0.1, 20.0,
     "How far a place covers at most, metres: a block"},
    {"place-reach-near", &PlaceOptions::near_reach_m, 0.1, 20.0,
     "How far a place covers in narrow space, metres: where furniture makes ways wind, places "
     "must be close to be no detour"},
    {"place-reach-rise", &PlaceOptions::reach_rise, 0.0, 10.0,
     "... and by how much more for each metre of its clearance, metres: few places in halls"},
    {"place-volume-step", &PlaceOptions::volume_step_m, 0.05, 5.0,
     "Distance of the spots that have to be covered in a volume, metres: coarser, there are more"},
    {"place-volume-reach", &PlaceOptions::volume_reach_m, 0.1, 20.0,
     "How far a place covers in a volume, metres: there is little that makes ways wind"},
    {"place-corner-reach", &PlaceOptions::corner_reach_m, 0.1, 20.0,
     "How far a place covers corners that are too narrow for a robot, metres: it sees them only"},
    {"place-link", &PlaceOptions::link_m, 0.1, 20.0,
     "Greatest length of a link between neighbours, metres: twice what a place covers, and more"},
    {"place-link-apart", &PlaceOptions::link_apart_cosine, -1.0, 1.0,
     "Links of a place are at an angle of this cosine at least: 30 degrees, at most one a "
     "direction"},
    {"place-link-count", &PlaceOptions::link_count_max, 1.0, 100.0,
     "Greatest number of links that a place seeks: all around at 30 degrees"},
    {"place-way", &PlaceOptions::way_m, 0.1, 20.0,
     "Greatest length of a link on a way around obstacles, metres: a little more than between "
     "neighbours"},
    {"place-bend", &PlaceOptions::bend_m, 0.0, 5.0,
     "A place this near to a bend of such a way serves instead of a new one, metres"},
    {"place-narrow", &PlaceOptions::narrow_weight, 0.0, 100.0,
     "How much dearer a way along obstacles is than through the middle, in lengths at a robot's "
     "radius: twice as dear"},
    {"place-detour", &PlaceOptions::detour, 1.0, 10.0,
     "Places get a way of their own if the one over others is longer by this factor: a tenth is "
     "no detour"},
    {"place-heir", &PlaceOptions::heir_m, 0.0, 5.0,
     "A place goes if another one this near can take all its links, metres: closer than places "
     "that cover narrow space"},
    {"place-landing", &PlaceOptions::landing_m, 0.05, 1.0,
     "A robot is on a floor while its feet are this near to it, metres: two steps"},
    {"place-lift-run", &PlaceOptions::lift_run_m, 0.0, 10.0,
     "A way between floors that goes no farther along the floor is a lift, metres: a cabin"},
    {"place-ramp-slope", &PlaceOptions::ramp_slope, 0.0, 10.0,
     "... and one that rises by no more for each metre is a ramp, metres: stairs are steeper"},
    {"place-free-box", &PlaceOptions::free_box_m, 0.0, 20.0,
     "How far the free box of a place reaches to each side at most, metres: most rooms are "
     "smaller"},
    {"place-same", &PlaceOptions::same_m, 0.05, 10.0,
     "A place goes on as one this near, metres: they move a little while the map grows"},
    {"place-sight-count", &PlaceOptions::sight_place_count, 1.0, 10000.0,
     "Among so many nearest places one in sight is looked for: a farther one is not where a thing "
     "is"},
    {"place-sight-forgiven", &PlaceOptions::sight_forgiven_m, 0.0, 5.0,
     "Sight begins this far from a thing or a person, metres: both touch what is mapped around "
     "them"},
    {"place-eye-low", &PlaceOptions::eye_low_m, 0.0, 5.0,
     "Who stands at a place looks from this height at least, metres: over tables"},
    {"place-eye-high", &PlaceOptions::eye_high_m, 0.0, 5.0,
     "... and from this height at most, metres: a person's eyes", "place-eye-low"},
    {"place-above-furniture", &PlaceOptions::above_furniture_m, 0.0, 10.0,
     "Where no place is in sight, one that no wall hides at this height is taken, metres: above "
     "furniture and below lintels"},
};

}  // namespace

std::vector<BoundOption> PlaceOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PlaceOptions>(kFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
