// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/frontend_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<ConsensusOptions> kConsensusFields[] = {
    {"odometry-consensus-probability", &ConsensusOptions::probability, 0.5, 0.999999,
     "Chance that one of the samples of a search holds no outlier: RSS 2020's front-end has 0.995"},
    {"odometry-consensus-draws-min", &ConsensusOptions::draw_count_min, 1, 100'000,
     "Samples at least: one sample of noisy points is a poor motion"},
    {"odometry-consensus-draws", &ConsensusOptions::draw_count_max, 1, 100'000,
     "Samples at most: five points with 70 per cent of outliers take 2178"},
    {"odometry-consensus-points", &ConsensusOptions::agree_count_min, 1, 10'000,
     "Points that agree with a motion, so many at least: fewer do by accident"},
    {"odometry-consensus-share", &ConsensusOptions::agree_share_min, 0.0, 1.0,
     "... and such a share of all: a tenth of unrelated points agrees with the best motion"},
    {"odometry-consensus-seed", &ConsensusOptions::seed, 0, 2'147'483'647,
     "Seed of the samples: the same seed gives the same result"},
};

constexpr OptionField<RelativePoseOptions> kRelativePoseFields[] = {
    {"odometry-pose-refine", &RelativePoseOptions::refine_count, 0, 100,
     "Steps by which a motion is refined on the points that agree: it has converged by then"},
    {"odometry-pose-inlier", &RelativePoseOptions::inlier_px, 0.05, 50.0,
     "A feature agrees with a motion that it misses by this at most, pixels: three times the noise "
     "of a tracked feature"},
    {"odometry-pose-soft", &RelativePoseOptions::soft_px, 0.01, 50.0,
     "Misses of this size cost half of what an outlier does, pixels: twice the noise of a tracked "
     "feature, so that what agrees by accident pulls at little"},
    {"odometry-parallax", &RelativePoseOptions::parallax_px_min, 0.0, 100.0,
     "With less flow than this between two images, the rotation taken off, there is no "
     "translation, pixels: the noise of a tracked feature"},
    {"odometry-parallax-noise", &RelativePoseOptions::parallax_noise_ratio, 0.0, 100.0,
     "... nor with less than so many times what the features miss the motion by: noise alone gives "
     "1.7"},
    {"odometry-twin-angle", &RelativePoseOptions::twin_deg, 1.0, 180.0,
     "Two motions differ if their translations do by this at least, degrees: noise turns a "
     "translation by less"},
    {"odometry-twin-cost", &RelativePoseOptions::twin_cost_ratio, 1.0, 100.0,
     "A second motion is told if the features that agree cost at most so many times as much with "
     "it: on a plane both differ by chance only"},
    {"odometry-noise", &RelativePoseOptions::noise_px_min, 0.0, 10.0,
     "... where features miss a motion by this at least, pixels: trackers are not better"},
    {"odometry-pose-chi-square", &RelativePoseOptions::chi_square_max, 0.1, 1000.0,
     "A stereo point agrees with a motion if its squared distance is at most so many times its "
     "variance: 95 per cent of right ones"},
    {"odometry-sigma-pixel", &RelativePoseOptions::pixel_sigma_px, 0.01, 50.0,
     "Standard deviation of the place of a feature, pixels: a tracker's"},
    {"odometry-sigma-disparity", &RelativePoseOptions::disparity_sigma_px, 0.01, 50.0,
     "Standard deviation of a disparity, pixels: calibrations err too"},
};

constexpr OptionField<FeatureTrackerOptions> kTrackerFields[] = {
    {"odometry-feature-cell", &FeatureTrackerOptions::cell_px, 4, 1000,
     "Edge of the cells of which each has a feature, pixels: about 300 cells of 752 x 480"},
    {"odometry-features", &FeatureTrackerOptions::feature_count_max, 1, 10'000,
     "Features at most: more add time, and little accuracy"},
    {"odometry-feature-apart", &FeatureTrackerOptions::apart_px_min, 0.0, 1000.0,
     "Features are found this far from each other, pixels: windows that overlap say the same "
     "twice"},
    {"odometry-feature-border", &FeatureTrackerOptions::border_px, 0, 200,
     "... and from the border of the image, pixels: most of a window is in the image"},
    {"odometry-corner-gradient", &FeatureTrackerOptions::corner_gradient_min, 0.0, 255.0,
     "Least gradient of a corner across its weakest direction, grey levels a pixel: noise shows 1"},
    {"odometry-corner-share", &FeatureTrackerOptions::corner_share_min, 0.0, 1.0,
     "... and share of the strongest corner's: a thousandth of its square"},
    {"odometry-corner-reach", &FeatureTrackerOptions::corner_reach_px, 1, 15,
     "Gradients of a corner are taken this far beside it, pixels: small corners are sharp"},
    {"odometry-feature-age", &FeatureTrackerOptions::keyframe_count_max, 1, 100'000,
     "Features are dropped after so many keyframes: windows drift as views change"},
    {"odometry-track-window", &FeatureTrackerOptions::window_reach_px, 2, 50,
     "Windows that are sought in the next image reach this far beside the feature, pixels: noise "
     "against depth edges"},
    {"odometry-track-flat", &FeatureTrackerOptions::flat_reach_px, 0, 200,
     "Brightness is compared once the mean of the pixels this near is subtracted, pixels: a lens "
     "darkens the borders of all images alike, which holds windows back; 0 = as it is. Only where "
     "a gyroscope leads (dvio)"},
    {"odometry-track-levels", &FeatureTrackerOptions::level_count, 1, 10,
     "Sizes of the image, each half of the one before, that they are sought in: with the rotation "
     "known, flow is short"},
    {"odometry-track-steps", &FeatureTrackerOptions::step_count_max, 1, 1000,
     "Steps of a search on each level at most: most take five"},
    {"odometry-track-step", &FeatureTrackerOptions::step_px_min, 1e-4, 1.0,
     "... and a step shorter than this is the last one, pixels: a tenth of the noise"},
    {"odometry-track-back", &FeatureTrackerOptions::back_px_max, 0.01, 50.0,
     "New features that are followed there and back come back within this, pixels: the noise of a "
     "tracked feature"},
    {"odometry-track-correlation", &FeatureTrackerOptions::correlation_min, -1.0, 1.0,
     "Least correlation of what is around a feature before and after: blur and noise leave 0.8"},
    {"odometry-track-correlation-reach", &FeatureTrackerOptions::correlation_reach_px, 1, 50,
     "... this far beside it, pixels: half of the window, which the background is part of"},
    {"odometry-track-merge", &FeatureTrackerOptions::merge_px, 0.0, 100.0,
     "Of two features this near to each other the older one stays, pixels: they are the same"},
    {"odometry-mask-growth", &FeatureTrackerOptions::mask_growth_px, 0, 100,
     "Masks of what moves grow by so much, pixels: a window beside it is half on it"},
};

constexpr OptionField<StereoMatchOptions> kMatchFields[] = {
    {"odometry-stereo-near", &StereoMatchOptions::nearest_m, 0.05, 1000.0,
     "Nearest distance at which features are matched, metres: a robot in a hand or in the air is "
     "as "
     "near to things"},
    {"odometry-stereo-far", &StereoMatchOptions::farthest_m, 0.1, 10'000.0,
     "... and farthest, metres: a disparity of 4 pixels with 0.1 m between the cameras errs by a "
     "quarter",
     "odometry-stereo-near"},
    {"odometry-stereo-patch", &StereoMatchOptions::patch_reach_px, 1, 31,
     "Patches that are matched reach this far beside the feature, pixels: noise against depth "
     "edges"},
    {"odometry-stereo-contrast", &StereoMatchOptions::contrast_min, 0.0, 128.0,
     "Least standard deviation of a patch, grey levels: twice the noise of the sensor"},
    {"odometry-stereo-row", &StereoMatchOptions::row_px_max, 0.0, 20.0,
     "Rows that both places may differ by, pixels: calibrations err by one"},
    {"odometry-stereo-correlation", &StereoMatchOptions::correlation_min, 0.0, 1.0,
     "Least correlation of both patches: what is seen from two sides looks a little different"},
    {"odometry-stereo-distinct", &StereoMatchOptions::distinct_min, 0.0, 1.0,
     "The next best place correlates by so much less: patterns that repeat have no depth"},
    {"odometry-stereo-refine", &StereoMatchOptions::refine_px_max, 0.0, 10.0,
     "Fractions are found this near to the best whole pixel, pixels: farther is another place"},
};

}  // namespace

std::vector<BoundOption> StereoMatchOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<StereoMatchOptions>(kMatchFields, this, &bound);
  return bound;
}

std::vector<BoundOption> FeatureTrackerOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<FeatureTrackerOptions>(kTrackerFields, this, &bound);
  return bound;
}

std::vector<BoundOption> FrontendOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<ConsensusOptions>(kConsensusFields, &relative_pose.consensus, &bound);
  BindFields<RelativePoseOptions>(kRelativePoseFields, &relative_pose, &bound);
  BindFields<FeatureTrackerOptions>(kTrackerFields, &tracker, &bound);
  BindFields<StereoMatchOptions>(kMatchFields, &stereo, &bound);
  return bound;
}

}  // namespace dsg::ingest
