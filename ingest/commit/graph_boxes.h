// SPDX-License-Identifier: Apache-2.0
// Lays a graph over an older one of the same map: who moved to another parent leaves the old one,
// and boxes go on holding what the map keeps below them.
#pragma once

#include "ingest/commit/map_view.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Adds to `delta` the ends of stored edges that it contradicts: a child for which it names
/// parents keeps no others, a node has one nearest place, and of the relations that it uses, two
/// nodes that it holds keep only the edges that it names. The rest stays as it is stored.
/// Grows the boxes of nodes that `map` has already, so that they hold the stored children that
/// stay with them. Nodes are neither added nor removed.
/// A map whose nodes cannot be looked up (one on a server) changes nothing.
absl::Status LayOverStoredGraph(const MapView& map, GraphDelta* delta);

}  // namespace dsg::ingest
