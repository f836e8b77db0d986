// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/find_again.h"

#include <algorithm>
#include <cmath>

#include "ingest/agents/tracking/association.h"

namespace dsg::ingest {
namespace {

// Beyond, exp() only loses digits; it is certain anyway.
constexpr double kRatioMax = 50.0;

bool IsReachable(const TorsoEstimate& from, const Stranger& stranger,
                 const TrackerOptions& options) {
  const double torso_m = (from.map_T_torso.position - stranger.skeleton->torso).norm();
  // Both ends may be as wrong as neighbours within a track may be.
  const double gap_s =
      static_cast<double>(stranger.first_ns - from.time_ns) / static_cast<double>(kNsPerSecond);
  return torso_m <= ReachM(options, 0) + options.again_speed_m_s * gap_s;
}

// From one of the last two poses, because any one may be metres off and the shape is the judge.
bool IsReachable(const TrackEntry& earlier, const Stranger& stranger,
                 const TrackerOptions& options) {
  const TimeNs gap_ns = stranger.first_ns - earlier.last_ns();
  if (gap_ns <= 0 || gap_ns > options.again_ns) return false;
  const std::vector<TorsoEstimate>& estimates = earlier.track().graph.estimates();
  const size_t first = estimates.size() > 2 ? estimates.size() - 2 : 0;
  return std::any_of(
      estimates.begin() + static_cast<std::ptrdiff_t>(first), estimates.end(),
      [&](const TorsoEstimate& from) { return IsReachable(from, stranger, options); });
}

}  // namespace

std::vector<SameAs> FindAgain(const Stranger& stranger,
                              const std::vector<const TrackEntry*>& earlier,
                              const ShapeStatistics& shapes, const TrackerOptions& options) {
  std::vector<SameAs> found;
  if (stranger.shape->count == 0) return found;
  double total = 1.0;
  for (const TrackEntry* track : earlier) {
    if (track->shape().count == 0 || !IsReachable(*track, stranger, options)) continue;
    const double ratio = std::min(kRatioMax, shapes.LogRatio(track->shape(), *stranger.shape));
    const double odds = std::exp(ratio);
    total += odds;
    // Likelier than anybody else is not enough when it is unlikely by itself.
    if (shapes.SquaredDistance(track->shape(), *stranger.shape) > options.again_shape_gate)
      continue;
    if (ratio >= options.again_ratio_min) found.push_back({track->track().id, odds});
  }
  for (SameAs& same : found) same.probability /= total;
  std::sort(found.begin(), found.end(), [](const SameAs& a, const SameAs& b) {
    return a.probability != b.probability ? a.probability > b.probability
                                          : a.earlier_track < b.earlier_track;
  });
  return found;
}

}  // namespace dsg::ingest
