// SPDX-License-Identifier: Apache-2.0
// What a session has told the map of its static layers, so that only what changed is told next.
// Refuses to know what the nodes mean.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// All that is believed of the static layers at one instant.
struct LayerGraph {
  std::vector<Node> nodes;
  std::vector<Edge> edges;
};

/// Threads: one caller at a time.
class GraphTold {
 public:
  /// The change from what was told to `now`: new and changed nodes and edges, edges that end, and
  /// nodes that are no longer believed to have been there. Coalesced; empty when nothing changed.
  /// `now` counts as told afterwards. Requires: every edge's ends are nodes of `now`.
  GraphDelta Tell(LayerGraph now);

 private:
  /// Payloads, by which versions are compared.
  std::map<NodeId, std::string> nodes_;
  std::map<EdgeKey, std::string> edges_;
};

}  // namespace dsg::ingest
