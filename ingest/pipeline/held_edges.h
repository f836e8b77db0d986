// SPDX-License-Identifier: Apache-2.0
// Whose hand a thing was seen in, which thing that was, and where it was put down.
// Refuses to choose between things that are about as likely.
#pragma once

#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "ingest/config/option_field.h"
#include "ingest/objects/carried_things.h"
#include "schema/model/edge.h"
#include "schema/model/node.h"

namespace dsg::ingest {

struct HeldOptions {
  /// Between a thing and the torso beside which it is carried, along the floor.
  double hand_m = 1.0;
  /// Of the points of a carry that are beside the person.
  double beside_share = 0.6;
  double visit_m = 1.2;
  TimeNs gap_ns_max = 2 * kNsPerSecond;
  /// How much likelier a thing is the one when it was found missing, and when the person came by
  /// just before; and how likely it is that the map never held the thing.
  double missed_factor = 3.0;
  double visited_factor = 6.0;
  double visit_fades_s = 30.0;
  double unknown_weight = 0.2;
  /// Things are mostly taken from near by.
  double near_m = 8.0;
  double walk_mps = 1.5;
  double probability_min = 0.6;

  std::vector<BoundOption> Bind();
};

/// HELD_BY from the object that a thing was before it was taken, to the person beside whose torso
/// it was seen; valid from when the person was nearest to where the object stood. SAME_AS from what
/// appeared where that person went, to it. Weights are probabilities above the least one. The
/// objects of the thing's class are compared: was it seen there after, was it missed, did the
/// person come by, how far away was it; and the map may never have held it. Order: by carry. One
/// edge for a pair, with the way that was seen first.
std::vector<Edge> FindHeldEdges(const std::vector<AgentPath>& people,
                                const std::vector<Carry>& carries, const std::vector<Node>& objects,
                                const HeldOptions& options);

}  // namespace dsg::ingest
