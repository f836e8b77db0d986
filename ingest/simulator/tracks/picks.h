// SPDX-License-Identifier: Apache-2.0
// Small things that people take away while they stand beside them, for questions about who did.
// Refuses to take what stands on the floor, and the same thing twice.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/simulator/world/walker.h"
#include "ingest/simulator/world/world.h"
#include "schema/model/graph_delta.h"

namespace dsg::simulator {

struct Pick {
  /// Of the crowd.
  size_t agent = 0;
  /// Of the world's furniture.
  size_t object = 0;
  /// When it is taken, when a mapper saw it last, and when it missed it first.
  TimeNs at_ns = 0;
  TimeNs seen_ns = 0;
  TimeNs missed_ns = 0;
};

/// At most `count` picks within [0, until_ns), ascending by time, spread over all that people could
/// take: what is small and stands on something, within 0.8 m of where they stand for a while.
std::vector<Pick> DrawPicks(const World& world, const Planner& planner,
                            const std::vector<AgentSpec>& crowd, uint64_t seed, TimeNs until_ns,
                            int count);

/// Ends the objects' validity when they were first missed. Requires: `graph` is of the same world.
void ApplyPicks(const std::vector<Pick>& picks, GraphDelta* graph);

}  // namespace dsg::simulator
