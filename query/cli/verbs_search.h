// SPDX-License-Identifier: Apache-2.0
// The verbs that search the graph: find, around, subgraph.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "query/cli/arguments.h"
#include "query/cli/lookups.h"

namespace dsg::v1 {
class GetNeighborsResponse;
class SearchNodesResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct FindVerb {
  /// The words of the query.
  std::vector<std::string> words;
  std::string near;
  /// With `near` only. Metres; 0 = no limit.
  double max_distance_m = 0.0;
  std::string box;
  std::string at;
  bool count = false;
  bool explain = false;
  PictureOptions picture;
};

struct AroundVerb {
  std::string id;
  /// Empty = all.
  std::vector<std::string> relations;
  /// Neither = both directions.
  bool outgoing = false;
  bool incoming = false;
  std::string at;
};

struct SubgraphVerb {
  std::string id;
  /// Empty = CONTAINS.
  std::vector<std::string> relations;
  bool both_directions = false;
  /// Edges from the root; 0 = no limit.
  int32_t depth = 0;
  bool tree_only = false;
  FilterOptions filter;
};

/// One line per hit with its nearest room, then the plan if the reply has it.
std::string RenderHits(const v1::SearchNodesResponse& reply, const NodeNames& names);

/// One line per edge; "->" leads away from the node asked about.
std::string RenderNeighbors(const v1::GetNeighborsResponse& reply, const TimeText& times);

}  // namespace dsg::cli
