// SPDX-License-Identifier: Apache-2.0
// The verbs about nodes and edges: ls, edges, show, near.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"
#include "query/cli/list_writer.h"

namespace dsg::v1 {
class GetNodeResponse;
class ListNearestNodesResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct ListVerb {
  FilterOptions filter;
  std::string parent;
  std::string name;
  std::string box;
};

struct EdgesVerb {
  std::string source;
  std::string relation;
  std::string target;
  std::string at;
};

struct ShowVerb {
  std::string id;
};

struct NearVerb {
  std::string position;
  int32_t k = 5;
  FilterOptions filter;
  /// Metres; 0 = no limit.
  double max_distance_m = 0.0;
};

/// A row per node, with its distance; `list` has NearestColumns.
std::vector<ListColumn> NearestColumns();
absl::Status AddNearest(const v1::ListNearestNodesResponse& reply, ListWriter* list);

/// One line per field; fields that the node does not have are left out.
std::string RenderNode(const v1::GetNodeResponse& reply, const TimeText& times);

}  // namespace dsg::cli
