// SPDX-License-Identifier: Apache-2.0
// Who is who: detections of each image are given to tracks, and tracks to persons.
// Refuses to estimate where a torso was: each track's TorsoGraph does.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/agents/estimation/torso_graph.h"
#include "ingest/agents/person_observation.h"
#include "ingest/agents/tracking/tracker_options.h"
#include "ingest/trajectory/trajectory_change.h"

namespace dsg::ingest {

enum class TrackState { kTentative, kConfirmed, kLost, kClosed, kDropped };

/// "tentative", "confirmed", "lost", "closed", "dropped".
std::string_view ToString(TrackState state);

/// Another track that may be the same person, seen before.
struct SameAs {
  int64_t earlier_track = 0;
  double probability = 0.0;
};

/// What became of one track since the last call.
struct TrackChange {
  int64_t track = 0;
  TrackState state = TrackState::kTentative;
  /// The first estimate that may have moved or is new; estimates().size() when none.
  size_t first_estimate = 0;
  /// The first observation that is new.
  size_t first_observation = 0;
};

struct TrackerCounts {
  int64_t observation_count = 0;
  /// Ever confirmed.
  int64_t track_count = 0;
  int64_t dropped_track_count = 0;
  int64_t same_as_count = 0;
  /// Confirmed tracks that went on after they had been lost from sight by place.
  int64_t found_again_count = 0;
  /// Second boxes about a body, observations with numbers that are not finite, and weak ones that
  /// fitted no track: not used.
  int64_t duplicate_count = 0;
  int64_t unusable_count = 0;
  int64_t weak_unused_count = 0;
  /// Images before the last one.
  int64_t refused_image_count = 0;
};

/// Deterministic. Threads: one caller at a time.
class PersonTracker {
 public:
  /// One track, from its first detection on.
  struct Track {
    int64_t id = 0;
    TrackState state = TrackState::kTentative;
    TorsoGraph graph;
    /// As they came, ascending in time.
    std::vector<PersonObservation> observations;
    /// Mean over the observations; empty when none has any.
    std::vector<float> shape_coefficients;
    std::vector<SameAs> same_as;
  };

  /// `spill_folder`: of SpillFile, for tracks that are closed for good.
  explicit PersonTracker(const TrackerOptions& options, const std::string& spill_folder = "");
  ~PersonTracker();

  /// All observations of one image, in any order; may be none (people who are not seen coast).
  /// An image before the last one is refused: false, and nothing changes.
  bool Observe(TimeNs time_ns, std::vector<PersonObservation> observations);
  /// No more will come: closes all tracks and smooths each over its whole length.
  void Finish();

  /// The path that people were seen from has moved: each observation moves by its time, upright,
  /// and tracks are estimated anew.
  void Move(const TrajectoryChange& change);

  /// Confirmed tracks (and closed ones, and dropped ones, once) that changed since the last call,
  /// ascending by track. A track is told from its first observation on when it is confirmed. A
  /// closed one whose person is found again is told as confirmed again, and goes on where it ended.
  std::vector<TrackChange> TakeChanges();
  /// Requires: an id from TakeChanges, and of a dropped track one of its last call. Tracks are kept
  /// until the end, those that nobody can be found again in on disk: what is returned is valid
  /// until the next call of this, TakeChanges, Observe or Move.
  const Track& track(int64_t id) const;
  /// Tracks that went to disk since the last call: nothing will be told of them any more, unless
  /// the path moves.
  std::vector<int64_t> TakeClosed();
  /// Of the disk; once it is not OK, nothing that was told may be used.
  const absl::Status& status() const;
  TrackerCounts counts() const;
  /// Frees the meshes and coefficients of a track's observations from `first` on: they are large,
  /// and of no use to the tracker.
  void ForgetShapes(int64_t id, size_t first);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::ingest
