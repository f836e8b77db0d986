// SPDX-License-Identifier: Apache-2.0
// With whom a thing that left a spot, or appeared on one, was seen on its way.
// Refuses to judge what was seen: HELD_BY edges and their probabilities are the mapper's.
#pragma once

#include <vector>

#include "query/engine/interaction/object_change.h"
#include "query/view/graph_view.h"

namespace dsg::query {

struct Hold {
  NodeId agent;
  /// The object of the change, or what that was before by SAME_AS.
  NodeId object;
  /// That the thing was this object, above 0.5.
  double probability = 0.0;
  Interval during;
};

/// Of a picked object: holds that began while it went, or until 30 s after it was missed. Of a put
/// one: holds that ended while it came, or at most 30 s before. The likeliest of each agent.
/// Order: by agent.
std::vector<Hold> FindHolds(const GraphView& view, const ObjectChange& change);

}  // namespace dsg::query
