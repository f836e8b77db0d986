// SPDX-License-Identifier: Apache-2.0
// What matched features of two keyframes say of how their cameras stood to each other.
#pragma once

#include <span>
#include <vector>

#include "ingest/odometry/frontend/sighting_pose.h"
#include "ingest/recognition/descriptor_match_internal.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Matches of which at least one feature has a depth, and what each of them says.
struct ViewSightings {
  std::vector<FeatureMatch> matches;
  std::vector<PointSighting> sightings;
};

/// In the order of the matches. Where both features have a depth, `from` knows the point.
ViewSightings SightingsOf(const KeyframeFeatures& from, const KeyframeFeatures& to,
                          std::span<const FeatureMatch> matches);

/// All features with a depth, matched with what is near to where `from_T_to` says; `bits` is
/// BitsOfAllPairs. Each feature at most once.
std::vector<FeatureMatch> MatchesNear(const KeyframeFeatures& from, const KeyframeFeatures& to,
                                      const cv::Mat1i& bits, const SightingPoseSearch& search,
                                      const Pose3d& from_T_to, const PlaceVerifierOptions& options);

}  // namespace dsg::ingest
