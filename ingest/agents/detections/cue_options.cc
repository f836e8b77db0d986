// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/detections/cue_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<PlacementOptions> kPlacementFields[] = {
    {"person-fit-visibility", &PlacementOptions::fit_visibility_min, 0.0, 1.0,
     "Joints at least this visible place the body: those of 0 have no pixel of their own"},
    {"person-fit-huber", &PlacementOptions::huber_px, 0.1, 100.0,
     "Joints that are off by more count less, pixels: what a good network errs by"},
    {"person-fit-noise", &PlacementOptions::noise_px_min, 0.01, 100.0,
     "Noise of a joint's pixel at least, pixels: no network is better than a pixel"},
    {"person-fit-good", &PlacementOptions::good_px, 0.0, 1000.0,
     "Bodies that fit their pixels worse are turned too, pixels: twice the noise of joints"},
    {"person-fit-turn", &PlacementOptions::turn_rad_max, 0.0, 3.1,
     "... by at most this, radians: further, it is another body or a mirrored one"},
    {"person-height", &PlacementOptions::body_height_m, 0.5, 2.5,
     "Height of a body of which only the box is known, metres: the mean of adults"},
    {"person-pelvis-share", &PlacementOptions::pelvis_share, 0.1, 0.9,
     "Height of the pelvis above the soles, of the body's height: that of adults"},
    {"person-ray-share", &PlacementOptions::ray_share, 0.0, 1.0,
     "What a network errs by along the ray, of the distance: bodies are 12 % taller or shorter "
     "than it believes"},
    {"person-ray", &PlacementOptions::ray_m, 0.01, 5.0, "... and beyond it, metres: posture"},
    {"person-box-ray-share", &PlacementOptions::box_ray_share, 0.0, 1.0,
     "The same of a body of which only the box is known, of the distance: a box knows less"},
    {"person-box-ray", &PlacementOptions::box_ray_m, 0.01, 5.0, "... and beyond it, metres"},
    {"person-side-share", &PlacementOptions::lateral_share, 0.0, 1.0,
     "What a network errs by across the ray, of the distance: some pixels"},
    {"person-side", &PlacementOptions::lateral_m, 0.01, 5.0,
     "... and beyond it, metres: where in the body the pelvis is"},
    {"person-hidden-side", &PlacementOptions::hidden_lateral_m, 0.0, 5.0,
     "What it errs by across the ray for a body that is hidden as a whole, metres: the place of "
     "the hidden part is guessed"},
    {"person-pose-sigma", &PlacementOptions::pose_sigma_rad, 0.01, 3.0,
     "Error of the heading by the pose coefficients, radians: they come from the whole picture"},
    {"person-joint-sigma", &PlacementOptions::joint_sigma_rad, 0.01, 3.0,
     "The same by joints alone, radians: a joint comes from one place"},
    {"person-hidden-sigma", &PlacementOptions::hidden_sigma_rad, 0.0, 3.0,
     "What a body that is hidden as a whole adds to it, radians: hidden bodies are guessed"},
    {"person-forward", &PlacementOptions::forward_min, 0.0, 1.0,
     "Least horizontal part of \"forward\" that makes a heading: of somebody who lies or bends "
     "far, it is noise"},
};

constexpr OptionField<FloorCueOptions> kFloorFields[] = {
    {"person-joint-visibility", &FloorCueOptions::visibility_min, 0.0, 1.0,
     "Joints that are less visible say nothing of where the body is: they are hidden"},
    {"person-floor-border", &FloorCueOptions::border_px, 0.0, 100.0,
     "A box this near to the image's border may be cut off, pixels: boxes are off by some"},
    {"person-floor-camera", &FloorCueOptions::camera_above_m, 0.01, 5.0,
     "Least height of a camera above the floor that sees where feet stand, metres: lower, a pixel "
     "is metres"},
    {"person-floor-pixels", &FloorCueOptions::contact_px, 0.1, 100.0,
     "Error of the lowest pixel of a body, pixels: boxes are off by some"},
    {"person-floor-contact", &FloorCueOptions::contact_m, 0.0, 2.0,
     "... and of the spot where it meets the floor, metres: toes and heels"},
    {"person-floor-legs", &FloorCueOptions::legs_m, 0.001, 2.0,
     "Error of the pelvis' place above the feet, metres: the network's legs are not the person's"},
    {"person-floor-hidden-legs", &FloorCueOptions::hidden_legs_m, 0.0, 2.0,
     "What a body that is hidden as a whole adds to it, metres: half a step"},
    {"person-floor-tip", &FloorCueOptions::tip_m, 0.0, 0.5,
     "From the middle of a foot to its tip or heel, metres: of adults"},
    {"person-floor-sole", &FloorCueOptions::sole_m, 0.0, 0.5,
     "From the middle of a foot down to the sole, metres: of adults"},
    {"person-floor-near", &FloorCueOptions::range_m_min, 0.0, 10.0,
     "Nearest distance that the floor says, metres: nearer, feet are out of the image"},
    {"person-floor-far", &FloorCueOptions::range_m_max, 1.0, 200.0,
     "Greatest distance of it, metres: farther, a pixel is a metre", "person-floor-near"},
    {"person-floor-aspect", &FloorCueOptions::aspect_min, 0.1, 10.0,
     "A box without joints is a whole standing body if it is so many times as high as wide: half "
     "bodies and pairs are wider"},
    {"person-floor-box", &FloorCueOptions::box_factor, 1.0, 100.0,
     "How many times less sure the floor is of a box without joints: where in the box the body is "
     "nobody knows"},
    {"person-legs-min", &FloorCueOptions::pelvis_m_min, 0.0, 1.0,
     "Lowest pelvis above the soles that is believed, metres: somebody who squats"},
    {"person-legs-max", &FloorCueOptions::pelvis_m_max, 0.5, 2.0,
     "Highest pelvis above the soles that is believed, metres: nobody's legs are longer",
     "person-legs-min"},
    {"person-skeleton", &FloorCueOptions::skeleton_m, 0.001, 2.0,
     "Error of the height of a skeleton's pelvis, metres: what good networks err by"},
    {"person-hidden-skeleton", &FloorCueOptions::hidden_skeleton_m, 0.0, 2.0,
     "What a body that is hidden as a whole adds to it, metres: hidden legs are guessed, bent or "
     "not"},
    {"person-head-top", &FloorCueOptions::head_top_m, 0.0, 0.5,
     "From the joint of the head to its top, metres: of adults"},
    {"person-stature", &FloorCueOptions::stature_m, 0.001, 1.0,
     "Spread of the height of adults, metres: a network that has a body's size wrong has it wrong "
     "in its skeleton too"},
    {"person-head-above", &FloorCueOptions::head_above_m, 0.01, 5.0,
     "Least height of a head above or below the camera that tells its distance, metres: at the "
     "height of the camera it says nothing"},
    {"person-torso-height", &FloorCueOptions::torso_height_m, 0.1, 2.0,
     "Height of a standing torso above its floor, metres: of adults"},
    {"person-torso-sigma", &FloorCueOptions::torso_height_sigma_m, 0.001, 2.0,
     "Spread of it, metres: adults of all sizes, and people who sit"},
};

constexpr OptionField<DepthCueOptions> kDepthFields[] = {
    {"person-depth-samples", &DepthCueOptions::sample_count, 100, 1e6,
     "Readings of a depth picture that are looked at for one body, about: medians need no more"},
    {"person-depth-margin", &DepthCueOptions::box_margin_px, 0.0, 100.0,
     "How far around its box a body may show in the depth picture, pixels: boxes are off by some"},
    {"person-depth-moment", &DepthCueOptions::same_picture_s, 0.0, 1.0,
     "Labels of a depth picture this near in time are the body's, seconds: half a period of 25 "
     "pictures a second"},
    {"person-depth-reach", &DepthCueOptions::reach_m, 0.1, 3.0,
     "Readings within this distance of their median are the body's, metres: half the reach of an "
     "adult's arms"},
    {"person-depth-pixels", &DepthCueOptions::pixel_count_min, 1, 10000,
     "Least number of readings of a body: fewer are its outline"},
    {"person-depth-patch", &DepthCueOptions::patch_px, 0, 100,
     "Readings this near to a joint of the trunk are the body's if there is no label, pixels: a "
     "trunk is wider"},
    {"person-depth-trunk", &DepthCueOptions::trunk_count_min, 1, 10000,
     "Least number of readings of a trunk: a median of fewer is noise"},
    {"person-depth-top", &DepthCueOptions::top_share, 0.5, 1.0,
     "Share of the readings below the top of the head: some are noise of the outline"},
    {"person-depth-shoulders", &DepthCueOptions::shoulders_m, 0.0, 1.0,
     "From the top of the head down to the shoulders, metres: of adults"},
    {"person-depth-pelvis", &DepthCueOptions::pelvis_m, 0.1, 2.0,
     "From the top of the head down to the pelvis, metres: of adults"},
    {"person-depth-half", &DepthCueOptions::half_body_m, 0.0, 0.5,
     "From the skin to the middle of the body, metres: of adults"},
    {"person-depth-range", &DepthCueOptions::range_m, 0.001, 2.0,
     "Error of the distance of a trunk, metres: arms before it, clothes"},
    {"person-depth-noise", &DepthCueOptions::range_per_m2, 0.0, 1.0,
     "... and what it grows by with the square of the distance, 1 / metre: that of depth cameras"},
    {"person-depth-stereo", &DepthCueOptions::stereo_per_m2, 0.0, 1.0,
     "The same of depth by two cameras, 1 / metre: mismatches at outlines"},
    {"person-depth-side", &DepthCueOptions::side_m, 0.001, 2.0,
     "Error to the side, metres: arms move the median"},
    {"person-depth-hidden", &DepthCueOptions::hidden_side_m, 0.0, 2.0,
     "What a body that is hidden as a whole adds to it, metres: half a trunk"},
    {"person-depth-no-trunk", &DepthCueOptions::no_trunk_factor, 1.0, 100.0,
     "How many times larger errors are if no trunk is seen: head, arms and legs move freely"},
    {"person-depth-no-label", &DepthCueOptions::no_label_factor, 1.0, 100.0,
     "How many times larger errors are without a label: it may be somebody else's trunk"},
};

}  // namespace

std::vector<BoundOption> CueOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PlacementOptions>(kPlacementFields, &placement, &bound);
  BindFields<FloorCueOptions>(kFloorFields, &floor, &bound);
  BindFields<DepthCueOptions>(kDepthFields, &depth, &bound);
  return bound;
}

}  // namespace dsg::ingest
