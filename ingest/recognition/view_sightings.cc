// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/view_sightings_internal.h"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "ingest/sensor/pinhole.h"

namespace dsg::ingest {
namespace {

PointSighting SightingOf(const KeyframeFeatures& from, const KeyframeFeatures& to,
                         const FeatureMatch& match, bool is_forward) {
  const KeyframeFeatures& knows = is_forward ? from : to;
  const KeyframeFeatures& sees = is_forward ? to : from;
  const KeyframeFeature& known =
      knows.features[static_cast<size_t>(is_forward ? match.from : match.to)];
  const KeyframeFeature& seen =
      sees.features[static_cast<size_t>(is_forward ? match.to : match.from)];
  const Eigen::Vector3d ray = PinholeRay(knows.camera, known.pixel.x(), known.pixel.y());
  PointSighting sighting;
  sighting.is_forward = is_forward;
  sighting.point = double{known.depth_m} * ray;
  sighting.depth_step = double{known.depth_sigma_m} * ray;
  sighting.aside_sigma_m = double{known.depth_m} * known.pixel_sigma_px / knows.camera.fx;
  sighting.pixel = seen.pixel.cast<double>();
  sighting.pixel_sigma_px = seen.pixel_sigma_px;
  if (seen.depth_m > 0.0f && seen.depth_sigma_m > 0.0f) {
    sighting.inverse_depth = 1.0 / seen.depth_m;
    sighting.inverse_sigma = seen.depth_sigma_m / (double{seen.depth_m} * seen.depth_m);
  }
  return sighting;
}

}  // namespace

ViewSightings SightingsOf(const KeyframeFeatures& from, const KeyframeFeatures& to,
                          std::span<const FeatureMatch> matches) {
  ViewSightings view;
  for (const FeatureMatch& match : matches) {
    const bool from_knows = from.features[static_cast<size_t>(match.from)].depth_m > 0.0f;
    const bool to_knows = to.features[static_cast<size_t>(match.to)].depth_m > 0.0f;
    if (!from_knows && !to_knows) continue;
    view.matches.push_back(match);
    view.sightings.push_back(SightingOf(from, to, match, from_knows));
  }
  return view;
}

std::vector<FeatureMatch> MatchesNear(const KeyframeFeatures& from, const KeyframeFeatures& to,
                                      const cv::Mat1i& bits, const SightingPoseSearch& search,
                                      const Pose3d& from_T_to,
                                      const PlaceVerifierOptions& options) {
  const Pose3d to_T_from = from_T_to.Inverse();
  // Bits that differ, then both features: the most alike ones first.
  std::vector<std::tuple<int, int, int>> near;
  for (int i = 0; i < static_cast<int>(from.features.size()); ++i) {
    const bool from_knows = from.features[static_cast<size_t>(i)].depth_m > 0.0f;
    for (int k = 0; k < static_cast<int>(to.features.size()); ++k) {
      if (bits(i, k) > options.search_bits_max) continue;
      const bool to_knows = to.features[static_cast<size_t>(k)].depth_m > 0.0f;
      if (!from_knows && !to_knows) continue;
      const PointSighting sighting = SightingOf(from, to, {i, k}, from_knows);
      // What the first pose errs by comes on top of what the match does.
      const double reach =
          std::max(options.search_sigmas, options.search_px / sighting.pixel_sigma_px);
      if (search.ChiSquareOf(sighting, from_T_to, to_T_from) <= reach * reach) {
        near.emplace_back(bits(i, k), i, k);
      }
    }
  }
  std::sort(near.begin(), near.end());
  std::vector<uint8_t> is_from_taken(from.features.size(), 0);
  std::vector<uint8_t> is_to_taken(to.features.size(), 0);
  std::vector<FeatureMatch> matches;
  for (const auto& [bit_count, i, k] : near) {
    uint8_t& from_taken = is_from_taken[static_cast<size_t>(i)];
    uint8_t& to_taken = is_to_taken[static_cast<size_t>(k)];
    if (from_taken != 0 || to_taken != 0) continue;
    from_taken = to_taken = 1;
    matches.push_back({i, k});
  }
  std::sort(matches.begin(), matches.end(),
            [](const FeatureMatch& a, const FeatureMatch& b) { return a.from < b.from; });
  return matches;
}

}  // namespace dsg::ingest
