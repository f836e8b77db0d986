// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/recognition_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<KeyframeFeatureOptions> kFeatureFields[] = {
    {"recognition-features", &KeyframeFeatureOptions::feature_count_max, 10, 4000,
     "Corners of a keyframe at most: more find more places again, and take memory and time"},
    {"recognition-feature-candidates", &KeyframeFeatureOptions::candidate_ratio, 1, 20,
     "... so many times as many are looked at, so that they are not all in one corner of the "
     "image"},
    {"recognition-feature-cell", &KeyframeFeatureOptions::cell_px, 8, 10'000,
     "Edge of the cells that share the corners, pixels: about 54 cells of 752 x 480"},
    {"recognition-feature-share", &KeyframeFeatureOptions::cell_share_max, 1.0, 1000.0,
     "A cell has so many times its share of the corners at most: most of an image may be blank"},
    {"recognition-levels", &KeyframeFeatureOptions::level_count, 1, 16,
     "Sizes of the image that corners are found on: eight of 1.2 see places from 3.6 times as far"},
    {"recognition-level-scale", &KeyframeFeatureOptions::level_scale, 1.05, 2.0,
     "... each smaller than the one before by this factor: descriptors bear a tenth of difference"},
    {"recognition-corner", &KeyframeFeatureOptions::corner_contrast, 1, 255,
     "How much brighter or darker the ring around a corner is, grey levels: mats and dim walls "
     "have less than the usual 20"},
    {"recognition-mask-growth", &KeyframeFeatureOptions::mask_growth_px, 0, 100,
     "Masks of what moves grow by so much, pixels: the reach of a descriptor"},
    {"recognition-sigma-pixel", &KeyframeFeatureOptions::pixel_sigma_px, 0.05, 50.0,
     "Standard deviation of the place of a corner, pixels of its level: corners are found at whole "
     "pixels; what agrees then errs as it should"},
    {"recognition-sigma-disparity", &KeyframeFeatureOptions::disparity_sigma_px, 0.05, 50.0,
     "Standard deviation of a disparity, pixels: calibrations err too"},
    {"recognition-sigma-depth", &KeyframeFeatureOptions::depth_sigma_m, 1e-4, 10.0,
     "Standard deviation of depths of a depth image, metres: a depth camera's at its nearest"},
    {"recognition-sigma-depth-square", &KeyframeFeatureOptions::depth_sigma_per_m2, 0.0, 1.0,
     "... and what is added for each square metre of depth: a depth camera's, 3 cm at 3 m"},
    {"recognition-depth-reach", &KeyframeFeatureOptions::depth_edge_px, 0, 50,
     "Depths so far beside a corner are compared with its own, pixels: where edges are smeared"},
    {"recognition-depth-edge", &KeyframeFeatureOptions::depth_edge_share, 0.0, 10.0,
     "... and a corner has no depth where they differ by this share: at an edge both may be meant"},
};

constexpr OptionField<PlaceIndexOptions> kIndexFields[] = {
    {"recognition-keyframes", &PlaceIndexOptions::keyframe_count_max, 2, 1'000'000,
     "Keyframes that are remembered; then every second one is forgotten: 400 MB with 1000 "
     "corners each"},
    {"recognition-index-features", &PlaceIndexOptions::feature_count_max, 1, 4096,
     "Corners of a keyframe that vote and are voted for, the strongest ones: half of them, in a "
     "quarter of the time"},
    {"recognition-vote-bits", &PlaceIndexOptions::vote_bits_max, 0, 256,
     "Corners look alike if at most so many of 256 bits differ: with more, plain corners of "
     "unrelated rooms do"},
    {"recognition-bucket", &PlaceIndexOptions::bucket_count_max, 1, 100'000'000,
     "Corners that share sixteen bits with more than so many others are not compared by these: "
     "bounds the time of a query"},
    {"recognition-recent", &PlaceIndexOptions::recent_ns, 0.0, 1e6,
     "Keyframes of the same path within this are no loops, seconds: odometry knows as much"},
    {"recognition-votes", &PlaceIndexOptions::vote_count_min, 1, 4000,
     "Corners that a keyframe has in common with the new one: fewer leave nothing to compare; "
     "which keyframes have the most decides"},
    {"recognition-island", &PlaceIndexOptions::island_gap_ns, 0.0, 1e6,
     "Keyframes of one path within this are one place, seconds: neighbours see the same"},
    {"recognition-candidates", &PlaceIndexOptions::candidate_count, 1, 1000,
     "Places that are compared by geometry: rooms of one kind look alike"},
    {"recognition-score-share", &PlaceIndexOptions::score_share_min, 0.0, 1.0,
     "... if their score is such a share of the best one's: a place seen again stands out"},
    {"recognition-consistency", &PlaceIndexOptions::consistency_count, 1, 100,
     "Keyframes in a row that have to find a place: one, because geometry decides, and because "
     "paths that cross see a place once"},
};

constexpr OptionField<PlaceVerifierOptions> kVerifierFields[] = {
    {"recognition-match-bits", &PlaceVerifierOptions::match_bits_max, 0, 256,
     "Corners of two keyframes match if at most so many of 256 bits differ: a quarter"},
    {"recognition-match-ratio", &PlaceVerifierOptions::match_ratio, 0.0, 1.0,
     "... and fewer than this share of what the next one differs by: patterns that repeat do not"},
    {"recognition-matches", &PlaceVerifierOptions::match_count_min, 5, 4000,
     "Matches at least: fewer are not looked at"},
    {"recognition-agree", &PlaceVerifierOptions::chi_square_max, 0.1, 1000.0,
     "A match agrees with a pose if its squared distance is at most so many times its variance: "
     "three standard deviations"},
    {"recognition-refine", &PlaceVerifierOptions::refine_count, 1, 100,
     "Steps by which a pose is refined on what agrees: it has converged by then"},
    {"recognition-search", &PlaceVerifierOptions::search_px, 0.0, 1000.0,
     "Corners are matched anew within this of where a pose says, pixels: what a first pose errs "
     "by"},
    {"recognition-search-sigmas", &PlaceVerifierOptions::search_sigmas, 0.0, 100.0,
     "... or within so many standard deviations of the corner, whichever is more"},
    {"recognition-search-bits", &PlaceVerifierOptions::search_bits_max, 0, 256,
     "... if at most so many bits differ: with more, wrong poses find matches of their own"},
    {"recognition-first", &PlaceVerifierOptions::agree_count_min, 3, 4000,
     "Of the matches before a pose was known, those that agree with it in the end: what is found "
     "by a wrong pose agrees with it, too"},
    {"recognition-first-share", &PlaceVerifierOptions::agree_share_min, 0.0, 1.0,
     "... and such a share of these: wrong poses have a fifth"},
    {"recognition-inliers", &PlaceVerifierOptions::inlier_count_min, 4, 4000,
     "Matches that agree with a pose that is believed, those found by it included: unrelated "
     "keyframes do not come so far"},
    {"recognition-parts", &PlaceVerifierOptions::part_count_min, 1, 48,
     "... in so many of 8 x 6 parts of each image: one poster is not a place, and poses of a small "
     "part may be flipped"},
    {"recognition-mono-inliers", &PlaceVerifierOptions::mono_inlier_count_min, 6, 4000,
     "Matches that agree where no depth is known: unrelated images have 13"},
    {"recognition-mono-share", &PlaceVerifierOptions::mono_inlier_share_min, 0.0, 1.0,
     "... and such a share of all matches"},
    {"recognition-mono-agree", &PlaceVerifierOptions::mono_inlier_px, 0.05, 50.0,
     "... each of which misses it by this at most, pixels: corners are found at whole pixels of "
     "their level"},
    {"recognition-mono-draws", &PlaceVerifierOptions::mono_draw_count_max, 1, 100'000,
     "Samples of five at most: of which two fifths are right take 515"},
    {"recognition-distance", &PlaceVerifierOptions::distance_m_max, 0.1, 10'000.0,
     "Keyframes this far apart are not believed to see the same, metres: a hall"},
    {"recognition-sigma-position", &PlaceVerifierOptions::position_sigma_max_m, 0.001, 100.0,
     "Largest standard deviation of a position that is of use, metres: half of a doorway"},
    {"recognition-sigma-turn", &PlaceVerifierOptions::turn_sigma_max_deg, 0.01, 180.0,
     "... and of a turn, degrees: odometry drifts by less in a minute"},
    {"recognition-floor-position", &PlaceVerifierOptions::position_floor_m, 0.0, 100.0,
     "Standard deviation that is added to positions, metres: wrong calibration, what has moved"},
    {"recognition-floor-turn", &PlaceVerifierOptions::turn_floor_deg, 0.0, 180.0,
     "... and to turns, degrees"},
};

constexpr OptionField<ConsensusOptions> kPlaceConsensusFields[] = {
    {"recognition-probability", &ConsensusOptions::probability, 0.5, 0.999999,
     "Chance that one of the samples of a search holds no outlier"},
    {"recognition-draws-min", &ConsensusOptions::draw_count_min, 1, 100'000,
     "Samples at least: one sample of noisy points is a poor pose"},
    {"recognition-draws", &ConsensusOptions::draw_count_max, 1, 100'000,
     "Samples at most: three points of which three tenths are right take 194"},
    {"recognition-draw-points", &ConsensusOptions::agree_count_min, 3, 10'000,
     "Matches that agree with a first pose, so many at least: fewer do by accident"},
    {"recognition-draw-share", &ConsensusOptions::agree_share_min, 0.0, 1.0,
     "... and such a share of all: a tenth of what stands elsewhere agrees with some pose"},
    {"recognition-seed", &ConsensusOptions::seed, 0, 2'147'483'647,
     "Seed of the samples: the same seed gives the same result"},
};

}  // namespace

std::vector<BoundOption> KeyframeFeatureOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<KeyframeFeatureOptions>(kFeatureFields, this, &bound);
  return bound;
}

std::vector<BoundOption> PlaceIndexOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PlaceIndexOptions>(kIndexFields, this, &bound);
  return bound;
}

std::vector<BoundOption> PlaceVerifierOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PlaceVerifierOptions>(kVerifierFields, this, &bound);
  BindFields<ConsensusOptions>(kPlaceConsensusFields, &consensus, &bound);
  return bound;
}

std::vector<BoundOption> RecognitionOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<KeyframeFeatureOptions>(kFeatureFields, &features, &bound);
  BindFields<PlaceIndexOptions>(kIndexFields, &index, &bound);
  BindFields<PlaceVerifierOptions>(kVerifierFields, &verifier, &bound);
  BindFields<ConsensusOptions>(kPlaceConsensusFields, &verifier.consensus, &bound);
  return bound;
}

}  // namespace dsg::ingest
