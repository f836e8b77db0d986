// SPDX-License-Identifier: Apache-2.0
// One track and what the tracker remembers beside it: its last skeleton, its shape, what was told.
// Refuses to decide what belongs to the track.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/agents/tracking/shape_statistics.h"
#include "ingest/agents/tracking/skeleton.h"
#include "ingest/files/spill_file.h"

namespace dsg::ingest {

/// An observation that waits for its track.
struct SeenPerson {
  PersonObservation observation;
  Skeleton skeleton;
  /// Of this observation alone; count 0 without a shape.
  ShapeMean shape;
};

/// Whether a torso graph takes it as it is weighed (IsUsable), and its joints are finite.
bool IsTrackable(const PersonObservation& observation, const TrackerOptions& options);

SeenPerson MakeSeen(PersonObservation observation);

class TrackEntry {
 public:
  TrackEntry(int64_t id, const TrackerOptions& options);

  /// Requires: later than the last; for Absorb, all of `other` later than the last.
  void Add(const SeenPerson& seen);
  void Absorb(TrackEntry* other);
  /// Over its whole length.
  void Smooth();
  /// With the path that it was seen from, smoothed too.
  void Move(const TrajectoryChange& change);
  void SetState(TrackState state);
  /// Nothing will be added any more: frees what only estimating needs, and puts observations and
  /// estimates into the file. Errors: of SpillFile; they stay in memory then.
  absl::Status PutAway(SpillFile* file);
  bool is_away() const { return away_count_ > 0 && track_.observations.empty(); }
  /// Reads them back. Errors: of SpillFile; they come as new then, as many as there were.
  absl::Status Fetch(const SpillFile& file);
  /// Of what was fetched, and is as it was.
  void LetGo();

  /// Whether enough hits are close together.
  bool IsConfirmable(TimeNs now_ns) const;
  /// What is new since the last call, if the track has been confirmed or dropped.
  std::optional<TrackChange> TakeChange();

  const PersonTracker::Track& track() const { return track_; }
  PersonTracker::Track* mutable_track() { return &track_; }
  TrackState state() const { return track_.state; }
  const ShapeMean& shape() const { return shape_; }
  const Skeleton& skeleton() const { return skeleton_; }
  TimeNs first_ns() const { return track_.observations.front().time_ns; }
  TimeNs last_ns() const { return track_.observations.back().time_ns; }
  bool was_confirmed() const { return was_confirmed_; }

 private:
  void Append(PersonObservation observation);
  void Solved(size_t first_moved);

  const TrackerOptions* options_;
  PersonTracker::Track track_;
  ShapeMean shape_;
  Skeleton skeleton_;
  bool was_confirmed_ = false;
  bool is_changed_ = false;
  /// Observations that are, or were, in the file; 0 = none.
  size_t away_count_ = 0;
  SpillPiece piece_;
  size_t first_estimate_ = 0;
  size_t first_observation_ = 0;
};

}  // namespace dsg::ingest
