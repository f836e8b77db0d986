// SPDX-License-Identifier: Apache-2.0
// People whose detections are known to the tests: made, tracked, and scored.
// Refuses to hand identities to the tracker: they are in the truth alone.
#pragma once

#include <map>
#include <vector>

#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/agents/tracking/shape_statistics.h"
#include "ingest/evaluation/humans.h"
#include "schema/base/random.h"

namespace dsg::ingest {

/// Seconds after an arbitrary start.
TimeNs AtS(double seconds);

/// Images in order of time, and whom each detection is of.
struct PeopleLog {
  std::map<TimeNs, std::vector<PersonObservation>> images;
  std::vector<evaluation::TrueDetection> truth;
};

/// Mean-free coefficients of a person.
ShapeVector DrawShape(Random* random);
std::vector<float> NoisyShape(const ShapeVector& shape, double sigma, Random* random);

/// A detection of a person at a place, without joints and shape.
PersonObservation ObservationAt(const Eigen::Vector3d& torso_map, double sigma_m);

/// Adds a detection of `human`, -1 = nobody, with the next detection id.
void AddDetection(TimeNs time_ns, int human, const Eigen::Vector3d& true_torso,
                  PersonObservation observation, PeopleLog* log);

/// All images through `tracker`, then to its end. Returns all changes told.
std::vector<TrackChange> RunAll(const PeopleLog& log, PersonTracker* tracker);

/// The confirmed tracks among `changes`, ascending.
std::vector<int64_t> ConfirmedTracks(const std::vector<TrackChange>& changes);

/// The tracks as believed in the end.
evaluation::HumanResult Score(const PeopleLog& log, const PersonTracker& tracker,
                              const std::vector<int64_t>& tracks);

/// Runs and scores.
evaluation::HumanResult TrackAndScore(const PeopleLog& log, const TrackerOptions& options,
                                      TrackerCounts* counts = nullptr);

}  // namespace dsg::ingest
