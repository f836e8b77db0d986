// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/shape_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<ShapeOptions> kShapeFields[] = {
    {"shape-keypoint-radius", &ShapeOptions::keypoint_radius_m, 0.02, 2.0,
     "Radius of the corners by which shapes are matched, metres: RSS 2020 has 0.15"},
    {"shape-keypoint-threshold", &ShapeOptions::keypoint_threshold, 0.0, 1.0,
     "Least response of such a corner: RSS 2020 has 0.0001"},
    {"shape-keypoints", &ShapeOptions::keypoint_count_max, 4, 1000,
     "Corners of a shape at most: all pairs with the object's are tried"},
    {"shape-noise", &ShapeOptions::noise_bound_m, 0.005, 1.0,
     "What matched corners are off by at most, metres: a voxel and a half"},
    {"shape-point-distance", &ShapeOptions::point_distance_m, 0.01, 1.0,
     "Surfaces are thinned to points this far apart, metres: a voxel"},
    {"shape-near", &ShapeOptions::inlier_m, 0.01, 1.0,
     "Points this near to the model are on it, metres: noise of the surface"},
    {"shape-near-share", &ShapeOptions::inlier_share_min, 0.0, 1.0,
     "Least share of an object's points on the model: the rest is what stands beside it"},
    {"shape-free-share", &ShapeOptions::free_share_max, 0.0, 1.0,
     "Greatest share of the model in space that was seen to be free: poses are off by some"},
    {"shape-free-around", &ShapeOptions::free_around_m, 0.0, 1.0,
     "... where it is free this far around, metres: a pose that is off by less is not "
     "contradicted"},
    {"shape-floor", &ShapeOptions::floor_tolerance_m, 0.0, 1.0,
     "How far off the floor's height an object may stand, metres: noise of the floor"},
    {"shape-free-weight", &ShapeOptions::free_weight, 0.0, 100.0,
     "What a share of the model in free space counts against a pose, of a share of points off the "
     "model: as much"},
    {"shape-covered-weight", &ShapeOptions::covered_weight, 0.0, 100.0,
     "What a share of the model with points counts for a pose: a little, since much is unseen"},
    {"shape-starts", &ShapeOptions::start_count, 1, 10000,
     "Poses that are aligned roughly: no true pose is far from one of these"},
    {"shape-candidates", &ShapeOptions::candidate_count, 1, 10000,
     "... of which so many are kept: different ones"},
    {"shape-finalists", &ShapeOptions::finalist_count, 1, 10000,
     "... and so many aligned exactly: it is slow"},
    {"shape-shaken", &ShapeOptions::shaken_count, 0, 10000,
     "The best poses, so many, are tried moved a little too: what stands beside pulls them off"},
    {"shape-shake", &ShapeOptions::shake_m, 0.0, 2.0, "... by this, metres"},
    {"shape-shake-turn", &ShapeOptions::shake_deg, 0.0, 90.0, "... and turned by this, degrees"},
    {"shape-slide", &ShapeOptions::point_weight, 0.0, 10.0,
     "What distances to points weigh against distances to their planes in an alignment: a little "
     "keeps poses from sliding along a plane"},
    {"shape-rough-steps", &ShapeOptions::rough_iteration_count, 1, 1000,
     "Steps of a rough alignment: it is near the end by then"},
    {"shape-rough-far", &ShapeOptions::rough_far_m, 0.01, 0.4,
     "Points this near to the model count in the first step from a start, metres: no start is "
     "farther from its true pose"},
    {"shape-rough-near", &ShapeOptions::rough_near_m, 0.01, 0.4,
     "... and in the last ones, metres: what stands beside it is left out"},
    {"shape-kept-far", &ShapeOptions::kept_far_m, 0.01, 0.4,
     "The same from the poses that are kept, and from shaken ones, metres: they are half as far "
     "off"},
    {"shape-kept-near", &ShapeOptions::kept_near_m, 0.01, 0.4,
     "... and in the last steps, metres: tight gates let go of what pulls a pose off"},
    {"shape-exact-steps", &ShapeOptions::exact_iteration_count, 1, 1000,
     "Steps of an exact alignment: it has converged by then"},
    {"shape-exact-near", &ShapeOptions::exact_near_m, 0.005, 0.4,
     "Points this near to the model count in its last steps, metres: a voxel and a half"},
    {"shape-points-min", &ShapeOptions::point_count_min, 3, 100'000,
     "With fewer points an object has no shape: they fit anything"},
    {"shape-points", &ShapeOptions::point_count_max, 10, 1'000'000,
     "Of more points so many stand for all: time"},
    {"shape-rough-points", &ShapeOptions::rough_point_count, 10, 1'000'000,
     "... and so many in rough alignments: they are many"},
    {"shape-free-points", &ShapeOptions::free_point_count, 10, 1'000'000,
     "Points of a model that are looked up in free space: a quarter of a per cent each"},
    {"shape-surface", &ShapeOptions::surface_m, 0.005, 0.5,
     "Points of a model are this far apart, metres: half a voxel"},
    {"shape-patch", &ShapeOptions::patch_m, 0.01, 2.0,
     "Edge of the patches of a model that are counted as seen, metres: two voxels"},
    {"shape-keypoints-min", &ShapeOptions::keypoint_count_min, 0, 1000,
     "With fewer corners evenly spread points take their place: smooth things have none"},
    {"shape-stray", &ShapeOptions::stray_share, 0.0, 0.5,
     "Share of the points that may be below an object whose floor is not known: strays"},
};

constexpr OptionField<StartOptions> kStartFields[] = {
    {"shape-turns", &StartOptions::turn_count, 1, 3600,
     "Turns about the vertical that are tried: of 10 degrees, an alignment finds the rest"},
    {"shape-look-near", &StartOptions::near_m, 0.02, 0.4,
     "Points this near to the model are on it at first sight, metres: half a turn moves the end of "
     "a couch by 0.09"},
    {"shape-look-points", &StartOptions::look_count, 10, 100'000,
     "Points that a first look takes: there are a thousand poses to look at"},
    {"shape-trim", &StartOptions::trim_share, 0.0, 0.4,
     "Share of an object's points off each side of its box before the model is laid against it: "
     "what bled over from neighbours"},
    {"shape-same", &StartOptions::same_m, 0.0, 2.0,
     "Poses this near to each other are one, metres: they end in the same pose"},
    {"shape-same-turn", &StartOptions::same_deg, 0.0, 180.0, "... and turned by this, degrees"},
};

}  // namespace

std::vector<BoundOption> ShapeOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<ShapeOptions>(kShapeFields, this, &bound);
  BindFields<StartOptions>(kStartFields, &starts, &bound);
  return bound;
}

}  // namespace dsg::ingest
