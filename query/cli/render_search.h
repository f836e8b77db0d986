// SPDX-License-Identifier: Apache-2.0
// What was found, what is around a node and what hangs on it, as text for people.
// Only turns replies into words.
#pragma once

#include <string>

#include "query/cli/node_names.h"
#include "query/cli/time_text.h"

namespace dsg::v1 {
class GetNeighborsResponse;
class GetSubgraphResponse;
class SearchNodesResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// A line a hit, the nearest ancestor beside it; then the plan, if it was sent.
std::string RenderHits(const v1::SearchNodesResponse& reply, const NodeNames& names);

/// A line an edge; "->" leads away from the node that was asked about.
std::string RenderNeighbors(const v1::GetNeighborsResponse& reply, const TimeText& times);

/// Nodes, then edges.
std::string RenderSubgraph(const v1::GetSubgraphResponse& reply, const TimeText& times);

}  // namespace dsg::cli
