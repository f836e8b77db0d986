// SPDX-License-Identifier: Apache-2.0
// The edges of a merged graph. A node keeps one parent, one nearest place and one support.
#pragma once

#include <set>
#include <vector>

#include "schema/merge/map_content.h"

namespace dsg::merge {

/// Attribute of an edge that attaches a copied node to its parent, nearest place or support: the
/// name of the map it came from. Edges that others have written since do not have it.
inline constexpr char kEdgeFrom[] = "merged_from";

/// Edges of `into` from an earlier merge that attach a copied node, where the other map attaches it
/// elsewhere now and nobody has changed the edge here. `id_of`: by node of `other`; `is_copy`: by
/// node of `into`.
/// Order: ascending.
std::vector<EdgeKey> ReplacedEdges(const MapContent& into, const MapContent& other,
                                   const std::vector<NodeId>& id_of,
                                   const std::vector<char>& is_copy);

/// New or extended edges, in ids of `into`, as if `into` did not have those in `replaced`. Leaves
/// out those in `written`. `id_of`: by node of `other`; `pair_of`: as MatchNodes.
/// Order: ascending by key.
std::vector<Edge> JoinEdges(const MapContent& into, const MapContent& other,
                            const std::vector<int>& pair_of, const std::vector<NodeId>& id_of,
                            const std::vector<EdgeKey>& replaced, const std::set<EdgeKey>& written);

/// TRAVERSABLE edges between new places and places of `into`, where one is in the free space of the
/// other and no fused place connects them.
/// Order: as JoinEdges.
std::vector<Edge> BridgePlaces(const MapContent& into, const MapContent& other,
                               const std::vector<int>& pair_of, const std::vector<NodeId>& id_of);

}  // namespace dsg::merge
