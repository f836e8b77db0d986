// SPDX-License-Identifier: Apache-2.0
// How places are recognised: all numbers that decide what is found again, and what is believed.
#pragma once

#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Of KeyframeFeatureFinder.
struct KeyframeFeatureOptions {
  /// Corners of a keyframe at most, and how many times as many are looked at to spread them.
  int feature_count_max = 1000;
  int candidate_ratio = 3;
  /// Edge of the cells that share the corners, pixels; a cell has so many times its share at most.
  int cell_px = 80;
  double cell_share_max = 4.0;
  /// Sizes of the image that corners are found on, each smaller than the one before by the factor.
  int level_count = 8;
  double level_scale = 1.2;
  /// How much brighter or darker the ring around a corner is, grey levels.
  int corner_contrast = 7;
  /// Masks are grown by this.
  int mask_growth_px = 16;
  /// Standard deviation of the place of a corner of the first level, pixels.
  double pixel_sigma_px = 0.7;
  /// Of a disparity, pixels.
  double disparity_sigma_px = 0.7;
  /// Of depths that are given: metres, and what is added for each square metre of depth.
  double depth_sigma_m = 0.005;
  double depth_sigma_per_m2 = 0.003;
  /// Depths this far beside a corner may differ from its own by this share, pixels.
  int depth_edge_px = 2;
  double depth_edge_share = 0.05;

  std::vector<BoundOption> Bind();
};

/// Of PlaceIndex.
struct PlaceIndexOptions {
  /// Keyframes at most.
  int keyframe_count_max = 4000;
  /// Corners of a keyframe that vote and are voted for at most, the strongest ones.
  int feature_count_max = 500;
  /// Corners look alike if their descriptors differ in this many bits at most.
  int vote_bits_max = 45;
  /// Descriptors that share sixteen bits with more than so many others tell nothing by them.
  int bucket_count_max = 200;
  /// Keyframes of the same track that are younger than this are no loops, seconds.
  TimeNs recent_ns = 10 * kNsPerSecond;
  /// Corners of the query that a keyframe has to look like.
  int vote_count_min = 8;
  /// Keyframes of one track within this are one island, of which the best one is looked at.
  TimeNs island_gap_ns = 3 * kNsPerSecond;
  /// Islands that are looked at, if they have such a share of the best one's score.
  int candidate_count = 3;
  double score_share_min = 0.2;
  /// Queries of a track, one after the other, that have to find an island.
  int consistency_count = 1;

  std::vector<BoundOption> Bind();
};

/// Of PlaceVerifier.
struct PlaceVerifierOptions {
  /// Corners match if they are each other's nearest, differ in this many bits at most, and by less
  /// than this share of what the next one differs by.
  int match_bits_max = 64;
  double match_ratio = 0.9;
  int match_count_min = 15;
  /// Samples of three matches; of five without any depth, with a bound of their own.
  ConsensusOptions consensus{.draw_count_max = 200, .agree_count_min = 10, .agree_share_min = 0.15};
  /// A match agrees with a pose if its squared distance, in units of its covariance, is this at
  /// most.
  double chi_square_max = 9.0;
  /// Steps of the refinement of a pose at most.
  int refine_count = 10;
  /// Once a pose is known, corners are matched anew within this of where it says, pixels, or so
  /// many standard deviations.
  double search_px = 4.0;
  double search_sigmas = 3.0;
  int search_bits_max = 50;
  /// First matches that agree with the pose in the end: so many, and such a share of those with a
  /// depth.
  int agree_count_min = 15;
  double agree_share_min = 0.3;
  /// All matches that agree, and of 8 x 6 parts of each image those that hold one.
  int inlier_count_min = 25;
  int part_count_min = 8;
  /// The same without any depth, where less is asked of a match; and such a share of all matches.
  int mono_inlier_count_min = 25;
  double mono_inlier_share_min = 0.4;
  double mono_inlier_px = 2.5;
  int mono_draw_count_max = 515;
  /// Poses this far apart are not believed, metres.
  double distance_m_max = 10.0;
  /// Standard deviations that are still of use, metres and degrees.
  double position_sigma_max_m = 0.5;
  double turn_sigma_max_deg = 3.0;
  /// Standard deviations that are added: what no model knows of, metres and degrees.
  double position_floor_m = 0.1;
  double turn_floor_deg = 0.6;

  std::vector<BoundOption> Bind();
};

struct RecognitionOptions {
  KeyframeFeatureOptions features;
  PlaceIndexOptions index;
  PlaceVerifierOptions verifier;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
