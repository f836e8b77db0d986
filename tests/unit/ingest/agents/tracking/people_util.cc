// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/agents/tracking/people_util.h"

#include <cmath>
#include <set>
#include <utility>

namespace dsg::ingest {

TimeNs AtS(double seconds) {
  return 1'700'000'000'000'000'000 + static_cast<TimeNs>(std::llround(seconds * 1e9));
}

ShapeVector DrawShape(Random* random) {
  ShapeVector shape;
  for (int i = 0; i < kShapeCount; ++i) shape[i] = random->Normal();
  return shape;
}

std::vector<float> NoisyShape(const ShapeVector& shape, double sigma, Random* random) {
  std::vector<float> out;
  for (int i = 0; i < kShapeCount; ++i) {
    out.push_back(static_cast<float>(shape[i] + sigma * random->Normal()));
  }
  return out;
}

PersonObservation ObservationAt(const Eigen::Vector3d& torso_map, double sigma_m) {
  PersonObservation observation;
  observation.map_T_torso.position = torso_map;
  observation.position_covariance_map = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  observation.has_heading = false;
  observation.heading_sigma_rad = 3.0;
  observation.camera_map = torso_map - Eigen::Vector3d(4.0, 0.0, -0.3);
  return observation;
}

void AddDetection(TimeNs time_ns, int human, const Eigen::Vector3d& true_torso,
                  PersonObservation observation, PeopleLog* log) {
  observation.time_ns = time_ns;
  observation.detection_id = std::ssize(log->truth) + 1;
  const Eigen::Vector3d detected = observation.map_T_torso.position;
  log->truth.push_back({time_ns, human, 1.0, true_torso, detected});
  log->images[time_ns].push_back(std::move(observation));
}

std::vector<TrackChange> RunAll(const PeopleLog& log, PersonTracker* tracker) {
  std::vector<TrackChange> all;
  const auto take = [&] {
    for (const TrackChange& change : tracker->TakeChanges()) all.push_back(change);
  };
  for (const auto& [time_ns, observations] : log.images) {
    tracker->Observe(time_ns, observations);
    take();
  }
  tracker->Finish();
  take();
  return all;
}

std::vector<int64_t> ConfirmedTracks(const std::vector<TrackChange>& changes) {
  std::set<int64_t> tracks;
  for (const TrackChange& change : changes) {
    if (change.state != TrackState::kDropped) tracks.insert(change.track);
  }
  return {tracks.begin(), tracks.end()};
}

evaluation::HumanResult Score(const PeopleLog& log, const PersonTracker& tracker,
                              const std::vector<int64_t>& tracks) {
  std::vector<evaluation::EstimatedPrior> priors;
  std::vector<evaluation::EstimatedTorso> poses;
  for (const int64_t id : tracks) {
    const PersonTracker::Track& track = tracker.track(id);
    const std::vector<TorsoEstimate>& estimates = track.graph.estimates();
    for (size_t i = 0; i < estimates.size(); ++i) {
      const Eigen::Vector3d& detected = track.observations[i].map_T_torso.position;
      priors.push_back({estimates[i].time_ns, static_cast<int>(id), detected, detected});
      poses.push_back(
          {estimates[i].time_ns, static_cast<int>(id), estimates[i].map_T_torso.position});
    }
  }
  return evaluation::EvaluateHumans(log.truth, priors, poses, {});
}

evaluation::HumanResult TrackAndScore(const PeopleLog& log, const TrackerOptions& options,
                                      TrackerCounts* counts) {
  PersonTracker tracker(options);
  const std::vector<int64_t> tracks = ConfirmedTracks(RunAll(log, &tracker));
  if (counts != nullptr) *counts = tracker.counts();
  return Score(log, tracker, tracks);
}

}  // namespace dsg::ingest
