// SPDX-License-Identifier: Apache-2.0
// What the poses and stays of a track mean between and around the instants that were stored: gaps,
// interpolation, visits to boxes, open stays. And how the factors and shapes along it are kept: in
// batches of one agent, as they were committed, which are ended whole; what was not meant of an
// ended batch is written anew. How batches are cut decides what counts in digests, so every backend
// cuts them alike.
#pragma once

#include <vector>

#include "schema/codec/trajectory_codec.h"
#include "schema/model/graph_delta.h"
#include "schema/store/snapshot.h"

namespace dsg {

/// NOT_FOUND/AGENT_UNKNOWN.
absl::Status UnknownAgent(const std::string& map, NodeId agent);

/// Whether an agent can be located at an instant.
/// Errors: OUT_OF_RANGE/TIME_OUTSIDE_TRACK, with both ends.
absl::Status CheckInTrack(const TrackInfo& track, TimeNs at_ns);

/// What `node` and its map say of the track of an agent; its poses are the caller's to add.
TrackInfo TrackInfoOf(const Node& node, const MapSpec& spec);

/// Where an agent was at an instant. `before` is the last stored pose that is not after it;
/// `after`, the first one after `before`, is not looked at when `before` is of that very instant.
LocatedPose LocateBetween(const StoredPose& before, const StoredPose& after, TimeNs at_ns,
                          TimeNs gap_ns_max, TrajectoryCodec codec);

/// Visits of one track's stretch to a box, exact to the nanosecond. `positions` ascend in time;
/// neighbours further apart than `gap_ns_max` are not joined. Appends to `visits`, joining with the
/// last where they touch.
void CollectVisits(NodeId agent, const std::vector<TimedPosition>& positions, TimeNs gap_ns_max,
                   const Box3d& box, TimeNs from_ns, TimeNs to_ns, std::vector<BoxVisit>* visits);

/// Ascending enter_ns, then agent.
void SortVisits(std::vector<BoxVisit>* visits);
void SortStays(std::vector<Stay>* stays);

/// An open stay ends where the track does; a closed one is as it is.
Stay ClipToTrack(Stay stay, const TrackInfo& track);

/// As Snapshot::Factors. What is equal in all of that goes by its bytes, so that the order does not
/// tell in which rows factors stand.
void SortFactors(std::vector<PoseFactor>* factors);

/// A batch of shapes is no longer, so that a reader of an instant looks back no further.
inline constexpr TimeNs kShapeBatchNsMax = 60 * kNsPerSecond;

struct BatchTimes {
  TimeNs t0 = kTimeMax;
  TimeNs t1 = kTimeMin;
};
/// First and last time of any end of a factor.
BatchTimes TimesOf(const std::vector<PoseFactor>& factors);

/// The shapes from `first` on that make one batch: at most kShapesPerSegmentMax and
/// kShapeBatchNsMax. Requires: there is one.
ShapeAppend CutBatch(const ShapeAppend& append, size_t first);

inline bool Holds(const TrackSpan& span, TimeNs t) { return span.from_ns <= t && t < span.to_ns; }
/// All of a batch goes with the span, whatever is in it.
inline bool Covers(const TrackSpan& span, TimeNs t0, TimeNs t1) {
  return span.from_ns <= t0 && t1 < span.to_ns;
}
/// Of a batch something may lie in the span.
inline bool MayTouch(const TrackSpan& span, TimeNs t0, TimeNs t1) {
  return t0 < span.to_ns && t1 >= span.from_ns;
}
/// An end of the factor that is the span's agent's lies in it.
bool Touches(const PoseFactor& factor, const TrackSpan& span);

}  // namespace dsg
