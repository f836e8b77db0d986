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
};

}  // namespace

std::vector<BoundOption> ShapeOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<ShapeOptions>(kShapeFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
