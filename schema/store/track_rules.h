// SPDX-License-Identifier: Apache-2.0
// What the poses and stays of a track mean between and around the instants that were stored: gaps,
// interpolation, visits to boxes, open stays.
#pragma once

#include <vector>

#include "schema/codec/trajectory_codec.h"
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

}  // namespace dsg
