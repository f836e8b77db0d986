// SPDX-License-Identifier: Apache-2.0
// What ages of policies count back from, when any clock may be wrong.
// Refuses to believe a time because it is the newest: something else must have been seen about
// then.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/duration.h"
#include "schema/store/graph_store.h"

namespace dsg {

class GraphIndex;

/// Clocks that are wrong by more are noticed; those that are wrong by less are believed.
inline constexpr TimeNs kClockLeapMaxNs = 7 * kNsPerDay;

/// The clock of a map's observations, as far as it can be trusted.
///
/// Now is the newest time that something else supports: another agent, or a thing that was
/// observed, at most kClockLeapMaxNs before. Where an agent's newest pose is not supported, its
/// poses before its own last leap speak for it. On a UNIX clock now is no later than the wall
/// clock, unless the map's epoch is later than that. Where nothing supports anything, now is the
/// oldest of what the agents and things say last: an age then takes too little rather than too
/// much.
///
/// An agent of which the end came into the map when others were already further by a leap has a
/// clock that is behind, or brought an old log. What it told counts as old from when the map
/// learnt it. Compacted revisions do not tell when that was; then its times count as they are.
struct WorldClock {
  /// nullopt in a map in which nothing was observed.
  std::optional<TimeNs> now_ns;
  /// Agents with times later than now by a leap. Ascending.
  std::vector<NodeId> ahead;
  /// By how much the clocks of agents were behind. Above kClockLeapMaxNs each.
  std::map<NodeId, TimeNs> lag_ns;

  /// What ages of an agent's times count back from. Requires: now_ns has a value.
  TimeNs NowOf(NodeId agent) const;
};

/// `wall_now_ns`: 0 = not known. `age_min_ns`: the least age that is asked for; no lag is looked
/// for of agents all of whose poses are younger. Cost:   reads tracks that are longer than a leap
/// and end in an unsupported pose; some dozen
///         lookups in the log of revisions for each other agent that was last seen longer ago than
///         a leap (2,000 of them in 2,100 revisions: 11 s).
/// Errors: what `stop` returned; NOT_FOUND and OUT_OF_RANGE when the map was compacted meanwhile.
absl::StatusOr<WorldClock> FindWorldClock(MapReader* reader, const Snapshot& map,
                                          const GraphIndex& index, TimeNs age_min_ns,
                                          int64_t wall_now_ns, const StopCheck& stop);

/// Says what ages count without; empty if all clocks agree.
std::string NoteOf(const WorldClock& clock);

}  // namespace dsg
