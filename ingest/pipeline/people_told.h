// SPDX-License-Identifier: Apache-2.0
// What a session has told the map of its people's tracks, so that only what changed is told next.
// Refuses to track; it turns tracks into nodes, poses, factors, shapes and edges.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/config/option_field.h"
#include "ingest/files/spill_file.h"
#include "ingest/pipeline/agent_namer.h"
#include "schema/codec/topology.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// What is told of tracks, in numbers.
struct TellOptions {
  /// A pose that moved by less keeps its row while the log runs, and at its end.
  double live_move_m = 0.03;
  double live_turn_rad = 0.1;
  double last_move_m = 0.001;
  double last_turn_rad = 0.005;
  /// Of a body about its torso, for people whose joints are not known.
  double half_width_m = 0.3;
  double below_m = 1.0;
  double above_m = 0.85;
  /// Joints are inside the body.
  double flesh_m = 0.1;

  std::vector<BoundOption> Bind();
};

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
    std::string name;
    /// Of a track that is closed for good they are on disk; ask PosesOf.
    std::vector<TimedPose> poses;
    SpillPiece away;
    size_t pose_count = 0;
    size_t observation_count = 0;
    size_t same_as_count = 0;
    TrackState state = TrackState::kTentative;
    bool is_told = false;
  };

  /// Tracks are named person-1, person-2, or unconfirmed-3 where they were dropped, with
  /// `agent_prefix` before all and `session_part` before the number. `body_topology`: LogInfo's;
  /// told with the first body that it fits. Requires: `namer` outlives this.
  PeopleTold(std::string session_id, std::string agent_prefix, std::string session_part,
             AgentNamer* namer, const TellOptions& options,
             std::shared_ptr<const Topology> body_topology = nullptr,
             const std::string& spill_folder = "")
      : session_id_(std::move(session_id)),
        agent_prefix_(std::move(agent_prefix)),
        session_part_(std::move(session_part)),
        namer_(namer),
        options_(options),
        body_topology_(std::move(body_topology)),
        file_(std::make_unique<SpillFile>(spill_folder)) {}

  /// The tracker's changes since the last call. Poses that were told and have moved come as
  /// corrections: live ones only when they moved by a few centimetres, all of them when `is_last`.
  GraphDelta Tell(PersonTracker* tracker, bool is_last);

  /// Poses that were told for the first time since the last call, ascending by agent, then time.
  std::vector<Sighting> TakeSightings();

  /// Tracks that have poses.
  int64_t agent_count() const;
  /// By the tracker's number; without those that were dropped.
  const std::map<int64_t, Person>& people() const { return people_; }
  /// Of one of them, ascending in time.
  std::vector<TimedPose> PosesOf(const Person& person) const;
  /// May be null.
  const Topology* body_topology() const { return body_topology_.get(); }
  /// Of the disk; once it is not OK, nothing that was told may be used.
  const absl::Status& status() const { return status_; }

 private:
  void PutAway(Person* person);
  Person& PersonOf(const PersonTracker::Track& track);
  void TellNode(const PersonTracker::Track& track, Person* person, GraphDelta* delta) const;
  void TellPoses(const PersonTracker::Track& track, size_t first_moved, bool is_last,
                 Person* person, GraphDelta* delta);
  void TellObservations(const PersonTracker::Track& track, Person* person, GraphDelta* delta);
  void TellShapes(const PersonTracker::Track& track, size_t first, NodeId agent, GraphDelta* delta);
  void TellSameAs(const PersonTracker::Track& track, Person* person, GraphDelta* delta);

  std::string session_id_;
  std::string agent_prefix_;
  std::string session_part_;
  AgentNamer* namer_;
  TellOptions options_;
  std::shared_ptr<const Topology> body_topology_;
  /// Set once it is told.
  std::optional<Sha256> topology_asset_;
  std::unique_ptr<SpillFile> file_;
  mutable absl::Status status_;
  std::map<int64_t, Person> people_;
  std::vector<Sighting> sightings_;
};

/// What keeps this session's names apart from those of the map's other sessions: empty for the
/// first one, else "1-", "2-". A session that was cut off finds its own again.
std::string SessionPart(const std::vector<Node>& known_agents, const std::string& agent_prefix,
                        const std::string& session_id);

}  // namespace dsg::ingest
