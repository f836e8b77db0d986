// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/small_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<SmallOptions> kSmallFields[] = {
    {"small-span", &SmallOptions::span_m, 0.02, 5.0,
     "Longest diagonal of a small thing, metres: what a person carries in a hand, with what a "
     "label adds at the outline"},
};

constexpr OptionField<SightingOptions> kSightingFields[] = {
    {"small-pixels", &SightingOptions::pixel_count_min, 1, 1e6,
     "Least number of pixels of a thing: fewer are noise of labels"},
    {"small-readings", &SightingOptions::reading_count_min, 1, 1e6,
     "Least number of its depth readings: a box of fewer is noise"},
    {"small-readings-max", &SightingOptions::reading_count_max, 10, 1e6,
     "Readings that are looked at, about: enough to tell where a large thing is"},
    {"small-points", &SightingOptions::point_count_max, 4, 1e5,
     "Points of its surface that are kept of one picture: enough for a box"},
    {"small-read-share", &SightingOptions::read_share_min, 0.0, 1.0,
     "Least share of its pixels that have a reading: glass and black plastic have fewer"},
    {"small-near", &SightingOptions::near_m, 0.01, 100.0,
     "Nearest thing, metres: nearer, depth cameras are blind"},
    {"small-far", &SightingOptions::far_m, 0.1, 100.0,
     "Farthest thing, metres: farther, a cup has a few pixels", "small-near"},
    {"small-noise", &SightingOptions::noise_m, 0.0, 1.0,
     "Standard deviation of a reading, metres: of depth cameras"},
    {"small-noise-square", &SightingOptions::noise_per_m2, 0.0, 1.0,
     "... and what it grows by with the square of the distance, 1 / metre"},
    {"small-noise-stereo", &SightingOptions::stereo_noise_per_m2, 0.0, 1.0,
     "The same of a stereo pair, 1 / metre: of one with 0.1 metres between its cameras"},
    {"small-depth-bin", &SightingOptions::depth_bin_m, 0.001, 1.0,
     "Depths are counted in bins of this, metres: half a cup; wider where noise is larger"},
    {"small-rare-share", &SightingOptions::rare_share, 0.0, 1.0,
     "Depths that fewer readings share than this part of the most frequent are of something else: "
     "labels bleed"},
    {"small-trim", &SightingOptions::trim_share, 0.0, 0.45,
     "Share of the readings at either end of each axis that a box leaves out: labels bleed"},
    {"small-high", &SightingOptions::high_min, 0.0, 10.0,
     "Things lower than this part of their width have no hidden back: seen from above they show "
     "all of themselves"},
    {"small-outline", &SightingOptions::outline_px, 0.0, 100.0,
     "What a label's outline is off by, pixels: two, of good networks"},
    {"small-back", &SightingOptions::back_share, 0.0, 1.0,
     "How far off a thing's guessed back is, of its diagonal: cups and books are not as deep as "
     "wide"},
    {"small-border", &SightingOptions::border_px, 0, 1000,
     "What is this near to the picture's border is cut, pixels: a label's outline"},
    {"small-before", &SightingOptions::before_m, 0.0, 10.0,
     "What is beside a thing and nearer by this hides some of it, metres: more than noise"},
    {"small-above-foot", &SightingOptions::above_foot_m, 0.0, 10.0,
     "... if it is higher than the thing's foot by this, metres: a table before a thing hides "
     "nothing"},
    {"small-hidden-share", &SightingOptions::hidden_share_max, 0.0, 1.0,
     "A thing is whole if less of its outline is hidden: a tenth does not move its middle"},
    {"small-scattered-share", &SightingOptions::scattered_share_max, 0.0, 1.0,
     "... and less of its pixels lies apart from the rest: noise of labels"},
    {"small-hand", &SightingOptions::hand_m, 0.0, 10.0,
     "A person beside it who is this near in depth may hold it, metres: a forearm"},
    {"small-held-share", &SightingOptions::held_share_min, 0.0, 0.5,
     "... if so much of the outline is the person's: two fingers"},
};

constexpr OptionField<SmallThingOptions> kThingFields[] = {
    {"small-gate", &SmallThingOptions::gate, 0.1, 1000.0,
     "Squared Mahalanobis distance of a sighting from its thing at most: 99 % of three degrees of "
     "freedom"},
    {"small-gate-metres", &SmallThingOptions::gate_m, 0.01, 10.0,
     "... and distance, metres: two things of a class stand side by side"},
    {"small-stand", &SmallThingOptions::stand_m, 0.001, 1.0,
     "Errors of poses and outlines that do not average out, metres"},
    {"small-whole", &SmallThingOptions::whole_count_min, 1, 1e6,
     "A thing was seen whole in so many pictures: fewer may be noise of labels"},
    {"small-time", &SmallThingOptions::span_min_ns, 0.0, 3600.0,
     "... over so much time, seconds: what is in a hand is gone by then"},
    {"small-viewpoints", &SmallThingOptions::viewpoints_m, 0.0, 100.0,
     "... or from viewpoints this far apart, metres: wrong labels change with the viewpoint"},
    {"small-seen-share", &SmallThingOptions::seen_share_min, 0.0, 1.0,
     "... and in this share of the pictures that should show it: networks miss small things"},
    {"small-large-share", &SmallThingOptions::large_share_max, 0.0, 1.0,
     "A class is one of small things if less of its sightings are large: next to none"},
    {"small-class", &SmallThingOptions::sighting_count_min, 1, 1e6,
     "... of so many at least: fewer do not tell"},
    {"small-forget", &SmallThingOptions::forget_ns, 0.0, 86400.0,
     "What is not confirmed is forgotten after this, seconds: a minute of a robot's tour"},
    {"small-apart", &SmallThingOptions::apart_share, 0.0, 10.0,
     "A sighting nearer to a thing of its class than this part of both diagonals is half of it: "
     "labels break things apart"},
    {"small-same", &SmallThingOptions::same_m, 0.0, 10.0,
     "Two things this near are one unless a picture shows both, metres: the width of a cup"},
    {"small-overlap", &SmallThingOptions::overlap_m, 0.0, 10.0,
     "A piece of mesh this near to a small thing of its class is the thing, metres: voxels round"},
    {"small-miss-near", &SmallThingOptions::miss_near_m, 0.0, 100.0,
     "Pictures from this distance on should show a thing, metres: nearer, half of it is outside"},
    {"small-miss-far", &SmallThingOptions::miss_far_m, 0.1, 100.0,
     "... and up to this one, metres: farther, networks miss it", "small-miss-near"},
    {"small-miss-hidden", &SmallThingOptions::hidden_m, 0.0, 10.0,
     "What stands before a thing by more hides it, metres: more than noise"},
    {"small-miss-border", &SmallThingOptions::miss_border_px, 0, 1000,
     "At the picture's border nothing is missed, pixels: half a small thing"},
    {"small-off-weight", &SmallThingOptions::off_weight, 0.0, 1000.0,
     "A view that is off by a centimetre is as bad as one from so many centimetres farther away: "
     "it shows where else the thing is"},
};

constexpr OptionField<CarryOptions> kCarryFields[] = {
    {"carried-gap", &CarryOptions::gap_ns_max, 0.0, 3600.0,
     "A thing in a hand goes on after so long a gap, seconds: a hand that is hidden for longer may "
     "hold another one"},
    {"carried-speed", &CarryOptions::speed_mps_max, 0.0, 100.0,
     "Fastest thing in a hand, metres / second: a brisk walk"},
    {"carried-reach", &CarryOptions::reach_m, 0.0, 10.0,
     "... and what sightings are off by, metres: an arm that swings"},
    {"carried-points", &CarryOptions::point_count_min, 2, 1e6,
     "It was seen so many times: fewer are wrong labels"},
    {"carried-way", &CarryOptions::way_m_min, 0.0, 100.0,
     "... and went so far, metres: what somebody stands beside does not move"},
};

}  // namespace

std::vector<BoundOption> SmallOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<SmallOptions>(kSmallFields, this, &bound);
  BindFields<SightingOptions>(kSightingFields, &sighting, &bound);
  BindFields<SmallThingOptions>(kThingFields, &thing, &bound);
  BindFields<CarryOptions>(kCarryFields, &carry, &bound);
  return bound;
}

}  // namespace dsg::ingest
