// SPDX-License-Identifier: Apache-2.0
// The edges of a merged graph: carried over, joined where both maps have them.
// Refuses a second parent, and a second nearest place or support.
#pragma once

#include <vector>

#include "schema/merge/map_content.h"

namespace dsg::merge {

/// New or widened edges in the ids of `into`. `id_of`: by node of `other`; `pair_of` as MatchNodes.
/// Order: ascending by key.
std::vector<Edge> JoinEdges(const MapContent& into, const MapContent& other,
                            const std::vector<int>& pair_of, const std::vector<NodeId>& id_of);

/// Ways between new places and places of `into` so near that one stands in the free space of the
/// other, where no fused place joins them. Order: as JoinEdges.
std::vector<Edge> BridgePlaces(const MapContent& into, const MapContent& other,
                               const std::vector<int>& pair_of, const std::vector<NodeId>& id_of);

}  // namespace dsg::merge
