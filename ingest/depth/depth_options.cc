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
    {"depth-stereo-texture-reach", &StereoOptions::texture_reach_px, 0, 50,
     "... over pixels this far beside it, pixels: as far as matches are refined"},
    {"depth-stereo-border", &StereoOptions::border_px, 0, 100,
     "What is this near to the border of a picture is left out, pixels: windows across it match "
     "its straight line"},
    {"depth-stereo-block", &StereoOptions::block_reach_px, 0, 5,
     "Blocks that are matched reach this far beside their pixel, pixels: small ones keep edges, "
     "large ones bear noise"},
    {"depth-stereo-step", &StereoOptions::step_penalty, 1, 32,
     "What a disparity costs that differs from the next pixel's by one, grey levels a pixel of the "
     "block: slanted surfaces"},
    {"depth-stereo-jump", &StereoOptions::jump_penalty, 2, 128,
     "... and by more: edges of things, four times as rare"},
    {"depth-stereo-agree", &StereoOptions::agree_px, 1, 64,
     "Matches from left to right and back agree within this, pixels: what one camera alone sees "
     "has no depth"},
    {"depth-stereo-gradient", &StereoOptions::gradient_max, 15, 63,
     "Gradients are cut at this before they are matched, grey levels: strong edges would outvote "
     "their surroundings"},
    {"depth-stereo-unique", &StereoOptions::unique_percent, 0, 90,
     "The second best match costs so much more at least, per cent: repeated patterns have no "
     "depth"},
    {"depth-stereo-speckle", &StereoOptions::speckle_px, 0, 100'000,
     "Spots of fewer pixels are dropped: matches by accident"},
    {"depth-stereo-speckle-step", &StereoOptions::speckle_step_px, 1, 64,
     "... in which disparities differ by this at most from pixel to pixel, pixels"},
};

constexpr OptionField<RefineOptions> kRefineFields[] = {
    {"depth-refine-reach", &RefineOptions::reach_px, 1, 50,
     "Fractions of a disparity are fitted to matches this far beside the pixel, pixels: noise "
     "against edges"},
    {"depth-refine-slope", &RefineOptions::slope_min, 1e-3, 1e4,
     "... if their squared gradient is this at least, grey levels a pixel: less tells nothing"},
    {"depth-refine-step", &RefineOptions::step_px_max, 0.0, 10.0,
     "... and if they are less than this, pixels: a longer step leaves what was matched"},
    {"depth-refine-rounds", &RefineOptions::round_count, 0, 20,
     "How often they are fitted: what is left then is less than a hundredth of a pixel"},
};

}  // namespace

std::vector<BoundOption> DepthOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<DepthOptions>(kDepthFields, this, &bound);
  BindFields<StereoOptions>(kStereoFields, &stereo, &bound);
  BindFields<RefineOptions>(kRefineFields, &stereo.refine, &bound);
  return bound;
}

}  // namespace dsg::ingest
