// SPDX-License-Identifier: Apache-2.0
// Whose hand a thing was seen in, which thing that was, and where it was put down.
// Refuses to choose between things that are about as likely.
#pragma once

#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "ingest/objects/carried_things.h"
#include "schema/model/edge.h"
#include "schema/model/node.h"

namespace dsg::ingest {

/// HELD_BY from the object that a thing was before it was taken, to the person beside whose torso
/// it was seen; valid from when the person was nearest to where the object stood. SAME_AS from what
/// appeared where that person went, to it. Weights are probabilities of 0.6 or more. The objects of
/// the thing's class are compared: was it seen there after, was it missed, did the person come by,
/// how far away was it; and the map may never have held it.
/// Order: by carry. One edge for a pair, with the way that was seen first.
std::vector<Edge> FindHeldEdges(const std::vector<AgentPath>& people,
                                const std::vector<Carry>& carries,
                                const std::vector<Node>& objects);

}  // namespace dsg::ingest
