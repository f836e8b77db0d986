// SPDX-License-Identifier: Apache-2.0
// What a session has told the map of its people's tracks, so that only what changed is told next.
// Refuses to track; it turns tracks into nodes, poses, factors, shapes and edges.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/pipeline/agent_namer.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class PeopleTold {
 public:
  struct Sighting {
    NodeId agent;
    TimeNs time_ns = 0;
    Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
  };

  /// A track as told last.
  struct Person {
    NodeId id;
    /// As told last.
    Node node;
    std::vector<TimedPose> poses;
    size_t observation_count = 0;
    size_t same_as_count = 0;
    TrackState state = TrackState::kTentative;
    bool is_told = false;
  };

  /// `name_prefix`: put before each track's number. Requires: `namer` outlives this.
  PeopleTold(std::string session_id, std::string name_prefix, AgentNamer* namer)
      : session_id_(std::move(session_id)), name_prefix_(std::move(name_prefix)), namer_(namer) {}

  /// The tracker's changes since the last call. Poses that were told and have moved come as
  /// corrections: live ones only when they moved by a few centimetres, all of them when `is_last`.
  GraphDelta Tell(PersonTracker* tracker, bool is_last);

  /// Poses as a loop closure has moved them. Agents that are none of these people are passed over.
  void Replace(const std::vector<TrajectoryCorrection>& corrections);

  /// Poses that were told for the first time since the last call, ascending by agent, then time.
  std::vector<Sighting> TakeSightings();

  /// Tracks that have poses.
  int64_t agent_count() const;
  /// By the tracker's number.
  const std::map<int64_t, Person>& people() const { return people_; }

 private:
  Person& PersonOf(int64_t track);
  void TellNode(const PersonTracker::Track& track, Person* person, GraphDelta* delta) const;
  void TellPoses(const PersonTracker::Track& track, size_t first_moved, bool is_last,
                 Person* person, GraphDelta* delta);
  void TellObservations(const PersonTracker::Track& track, Person* person, GraphDelta* delta) const;
  void TellSameAs(const PersonTracker::Track& track, Person* person, GraphDelta* delta);

  std::string session_id_;
  std::string name_prefix_;
  AgentNamer* namer_;
  std::map<int64_t, Person> people_;
  std::vector<Sighting> sightings_;
};

/// Names of this session's tracks begin so: `prefix` + "person-", and a number of the session when
/// the map holds other sessions' people. A session that was cut off finds its number again.
std::string PersonNamePrefix(const std::vector<Node>& known_agents, const std::string& prefix,
                             const std::string& session_id);

}  // namespace dsg::ingest
