// SPDX-License-Identifier: Apache-2.0
// Rows of evidence, each with its weight and a sentence for people.
// Refuses to read the map; what is weighed was measured before.
#pragma once

#include <vector>

#include "query/engine/interaction/carried.h"
#include "query/engine/interaction/hands.h"
#include "query/engine/interaction/held.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/verdict.h"

namespace dsg::query {

double SecondsBetween(TimeNs from_ns, TimeNs to_ns);

/// Of a visit that was seen: how near a hand came. `has_edge`: a NEAR edge tells of it.
void AddHand(const ObjectChange& change, NodeId agent, const Visit& visit, bool has_edge,
             Suspect* out);
/// Of a visit that was seen: how long, between the two looks at the object or not, and how much of
/// it was not observed.
void AddVisit(const ObjectChange& change, NodeId agent, const Visit& visit, Suspect* out);
/// Of a visit that nobody saw.
void AddPossibleVisit(NodeId agent, const Visit& visit, Suspect* out);
/// Of a put object: how long after `out->at_ns` it was first seen.
void AddDelay(const ObjectChange& change, Suspect* out);

/// Of whom the object was seen with.
void AddHeld(const ObjectChange& change, const Hold& hold, Suspect* out);
/// Somebody whom no pose has within reach, and who held the object all the same.
Suspect Holder(const ObjectChange& change, const Hold& hold);

/// Nothing happened: the mapper was wrong, or the object is beside its old spot; not so where it
/// was seen in a hand, as probably as that is.
Suspect FalseChange(const ObjectChange& change, const std::vector<OtherEnd>& ends,
                    const std::vector<Hold>& holds);
/// Somebody whom nobody saw, in all of the interval but `seen_s`; during `away_s` of it the map's
/// robots were elsewhere.
Suspect Unseen(const ObjectChange& change, double seen_s, double away_s);

}  // namespace dsg::query
