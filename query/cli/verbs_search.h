// SPDX-License-Identifier: Apache-2.0
// The verbs that search the graph: find, around, subgraph.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "query/cli/arguments.h"
#include "query/cli/list_writer.h"
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
  PictureOptions picture;
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

/// The columns of hits: with a distance if they have one, with the related nodes if there are any
/// or the format needs the same columns always.
std::vector<ListColumn> HitColumns(const v1::SearchNodesResponse& reply, const NodeNames& names,
                                   ListFormat format);
/// A row per hit with its nearest room; `columns` are those of `list`.
absl::Status AddHits(const v1::SearchNodesResponse& reply, const NodeNames& names,
                     const std::vector<ListColumn>& columns, ListWriter* list);
/// The number of hits, and the plan if the reply has it.
std::string HitsFooter(const v1::SearchNodesResponse& reply);

/// A row per edge, "->" leads away from the node asked about; `list` has NeighborColumns.
std::vector<ListColumn> NeighborColumns();
absl::Status AddNeighbors(const v1::GetNeighborsResponse& part, ListWriter* list);

}  // namespace dsg::cli
