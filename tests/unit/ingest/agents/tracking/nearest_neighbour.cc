// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/tracking/nearest_neighbour.h"

#include <algorithm>
#include <tuple>

namespace dsg::ingest {
namespace {

struct NearestTrack {
  TimeNs last_ns = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// For each observation the index of its track, -1 when none is near.
std::vector<int> Nearest(const std::vector<NearestTrack>& tracks, TimeNs time_ns,
                         const std::vector<PersonObservation>& seen,
                         const NearestOptions& options) {
  std::vector<std::tuple<double, size_t, size_t>> pairs;
  for (size_t i = 0; i < seen.size(); ++i) {
    for (size_t j = 0; j < tracks.size(); ++j) {
      if (time_ns - tracks[j].last_ns > options.close_ns) continue;
      const double apart_m = (seen[i].map_T_torso.position - tracks[j].position).norm();
      if (apart_m <= options.reach_m) pairs.emplace_back(apart_m, i, j);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int> track_of(seen.size(), -1);
  std::vector<bool> is_taken(tracks.size(), false);
  for (const auto& [apart_m, i, j] : pairs) {
    if (track_of[i] >= 0 || is_taken[j]) continue;
    track_of[i] = static_cast<int>(j);
    is_taken[j] = true;
  }
  return track_of;
}

}  // namespace

evaluation::HumanResult ScoreNearestNeighbour(const PeopleLog& log, const NearestOptions& options) {
  std::vector<NearestTrack> tracks;
  std::vector<evaluation::EstimatedPrior> priors;
  std::vector<evaluation::EstimatedTorso> poses;
  for (const auto& [time_ns, seen] : log.images) {
    const std::vector<int> track_of = Nearest(tracks, time_ns, seen, options);
    for (size_t i = 0; i < seen.size(); ++i) {
      const Eigen::Vector3d& at = seen[i].map_T_torso.position;
      int track = track_of[i];
      if (track < 0) {
        track = static_cast<int>(tracks.size());
        tracks.emplace_back();
      }
      tracks[static_cast<size_t>(track)] = {time_ns, at};
      priors.push_back({time_ns, track, at, at});
      poses.push_back({time_ns, track, at});
    }
  }
  return evaluation::EvaluateHumans(log.truth, priors, poses, {});
}

}  // namespace dsg::ingest
