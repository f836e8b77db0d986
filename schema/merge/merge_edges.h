// SPDX-License-Identifier: Apache-2.0
// The edges of a merged graph. A node keeps one parent, one nearest place and one support.
#pragma once

#include <set>
#include <vector>

#include "schema/merge/map_content.h"

namespace dsg::merge {

/// Attribute of an edge by which a copied node hangs on another one: the map that said so. One that
/// others have written since has it not.
inline constexpr char kEdgeFrom[] = "merged_from";

/// Edges of `into` that an earlier merge brought and that the other map has replaced since: those
/// by which a node copied whole from there has its parent, its nearest place or what it stands on,
/// where the other map now names another and nobody else has. `id_of`: by node of `other`;
/// `is_copy`: by node of `into`. Order: ascending.
std::vector<EdgeKey> ReplacedEdges(const MapContent& into, const MapContent& other,
                                   const std::vector<NodeId>& id_of,
                                   const std::vector<char>& is_copy);

/// New or widened edges in the ids of `into`, as if it had not those in `replaced`. Those in
/// `written` are not written again. `id_of`: by node of `other`; `pair_of` as MatchNodes. Order:
/// ascending by key.
std::vector<Edge> JoinEdges(const MapContent& into, const MapContent& other,
                            const std::vector<int>& pair_of, const std::vector<NodeId>& id_of,
                            const std::vector<EdgeKey>& replaced, const std::set<EdgeKey>& written);

/// Ways between new places and places of `into` so near that one stands in the free space of the
/// other, where no fused place joins them. Order: as JoinEdges.
std::vector<Edge> BridgePlaces(const MapContent& into, const MapContent& other,
                               const std::vector<int>& pair_of, const std::vector<NodeId>& id_of);

}  // namespace dsg::merge
