// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/depth_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<DepthOptions> kDepthFields[] = {
    {"depth-tolerance", &DepthOptions::tolerance_ns, 0.0, 1.0,
     "Colour, labels and detections this near in time belong to a depth picture, seconds: half a "
     "period of 25 pictures a second"},
    {"depth-pair-tolerance", &DepthOptions::pair_tolerance_ns, 0.0, 1.0,
     "The two pictures of a stereo pair are this near in time, seconds: cameras of a pair are "
     "triggered together"},
    {"depth-stereo-period", &DepthOptions::stereo_period_ns, 0.0, 3600.0,
     "Least time between two stereo pairs that are matched, seconds: each takes some hundredths "
     "of a second, and five a second see all of a walk"},
    {"depth-same-center", &DepthOptions::same_center_m, 0.0, 1.0,
     "Colour and labels of a camera this near to the depth camera are laid over depth, metres: off "
     "by less than two pixels at a metre"},
    {"depth-same-people", &DepthOptions::same_people_m, 0.0, 10.0,
     "Boxes of people of a camera this near are too, metres: boxes are coarse"},
    {"depth-mask-growth", &DepthOptions::mask_growth_px, 0, 100,
     "Masks of people grow by so much, pixels: labels end before clothes do"},
    {"depth-mask-edge", &DepthOptions::mask_edge_m, 0.01, 100.0,
     "... and as far again beside jumps in depth of more than this, metres: readings between "
     "person and background"},
    {"depth-mask-reach", &DepthOptions::body_reach_m, 0.0, 10.0,
     "In boxes of people whom labels miss, what is this near to their torso is masked, metres: "
     "half the reach of an adult's arms"},
    {"depth-mask-visibility", &DepthOptions::joint_visibility_min, 0.0, 1.0,
     "... which is between joints that are so visible: hidden ones are guessed"},
    {"depth-mask-labelled", &DepthOptions::labelled_share_min, 0.0, 1.0,
     "Labels miss who is in a box if they show people on less of it: noise"},
};

constexpr OptionField<StereoOptions> kStereoFields[] = {
    {"depth-stereo-near", &StereoOptions::nearest_m, 0.05, 10.0,
     "Nearest distance that a stereo pair is searched for, metres: nearer costs as much again"},
    {"depth-stereo-texture", &StereoOptions::texture_min, 0.0, 255.0,
     "Least gradient of what is matched, grey levels a pixel: a blank wall shows 0.5 by the noise "
     "of the sensor alone"},
};

}  // namespace

std::vector<BoundOption> DepthOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<DepthOptions>(kDepthFields, this, &bound);
  BindFields<StereoOptions>(kStereoFields, &stereo, &bound);
  return bound;
}

}  // namespace dsg::ingest
