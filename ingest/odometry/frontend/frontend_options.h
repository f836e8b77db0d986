// SPDX-License-Identifier: Apache-2.0
// How features are followed, matched and checked: all numbers that decide which are believed.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// How models are searched for among points of which many are wrong.
struct ConsensusOptions {
  /// Chance that one of the samples holds no outlier.
  double probability = 0.995;
  /// Samples at least, and at most.
  int draw_count_min = 20;
  int draw_count_max = 2500;
  /// Points that a model has to agree with: so many, and such a share of all.
  int agree_count_min = 10;
  double agree_share_min = 0.2;
  int seed = 1;
};

/// Of the four methods that find a relative pose, and of StereoPointOf.
struct RelativePoseOptions {
  ConsensusOptions consensus;
  /// Steps of the refinement of a motion on the points that agree with it.
  int refine_count = 5;
  /// A pair of bearings agrees with a motion if it misses it by this at most, pixels.
  double inlier_px = 1.5;
  /// Misses of this size cost half of what an outlier does, pixels: up to here they cost their
  /// square.
  double soft_px = 0.7;
  /// With less flow than this once the rotation is taken off (median), there is no translation,
  /// pixels.
  double parallax_px_min = 0.5;
  /// ... nor where this flow is less than so many times what the points miss the motion by: noise
  /// alone gives 1.7.
  double parallax_noise_ratio = 3.0;
  /// A second motion whose translation points elsewhere by this at least, degrees, is told if the
  /// points that agree cost at most so many times as much with it. Points are not believed to be
  /// better than `noise_px_min`, pixels.
  double twin_deg = 5.0;
  double twin_cost_ratio = 1.5;
  double noise_px_min = 0.1;
  /// A pair of stereo points agrees with a motion if its squared distance, in units of its
  /// covariance, is this at most.
  double chi_square_max = 7.815;
  /// Standard deviations of a pixel and of a disparity, pixels.
  double pixel_sigma_px = 0.5;
  double disparity_sigma_px = 1.0;
};

/// Of FeatureTracker.
struct FeatureTrackerOptions {
  /// Edge of the cells of which each has a feature, pixels; features at most.
  int cell_px = 35;
  int feature_count_max = 300;
  /// Features are found this far from each other and from the border, pixels.
  double apart_px_min = 15.0;
  int border_px = 8;
  /// A corner's gradient across its weakest direction: so many grey levels a pixel, and such a
  /// share of the image's strongest one, over pixels this far beside it.
  double corner_gradient_min = 1.5;
  double corner_share_min = 0.03;
  int corner_reach_px = 1;
  /// Features are dropped at the keyframe after so many.
  int keyframe_count_max = 25;
  /// What is sought in the next image: a window that reaches so far, on so many levels of halved
  /// size, in so many steps or until one is this short.
  int window_reach_px = 10;
  /// Before that, the mean of the pixels that are this near is subtracted; 0 = it is not.
  int flat_reach_px = 20;
  int level_count = 3;
  int step_count_max = 30;
  double step_px_min = 0.02;
  /// New features come back to where they were within this, pixels.
  double back_px_max = 0.5;
  /// Correlation of what is around a feature before and after, this far beside it.
  double correlation_min = 0.6;
  int correlation_reach_px = 5;
  /// Of two features that come this near to each other the older one stays.
  double merge_px = 3.0;
  /// Masks are grown by this.
  int mask_growth_px = 8;

  std::vector<BoundOption> Bind();
};

/// Of StereoMatcher.
struct StereoMatchOptions {
  /// Distances along the optical axis within which features are matched, metres.
  double nearest_m = 0.3;
  double farthest_m = 10.0;
  /// Patches reach this far beside the feature, pixels.
  int patch_reach_px = 5;
  /// Standard deviation of a patch that tells something, grey levels.
  double contrast_min = 3.0;
  /// Rows that the right place may be off, pixels.
  double row_px_max = 1.5;
  /// Correlation of both patches, and how much less the next best place has.
  double correlation_min = 0.8;
  double distinct_min = 0.05;
  /// Fractions of a pixel are found this near to the best whole one, pixels.
  double refine_px_max = 1.5;

  std::vector<BoundOption> Bind();
};

struct FrontendOptions {
  RelativePoseOptions relative_pose;
  FeatureTrackerOptions tracker;
  StereoMatchOptions stereo;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
