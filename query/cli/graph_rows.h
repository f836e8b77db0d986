// SPDX-License-Identifier: Apache-2.0
// Nodes and edges as rows of lists, the same in every verb.
#pragma once

#include <vector>

#include "query/cli/list_writer.h"

namespace dsg::v1 {
class Edge;
class Node;
}  // namespace dsg::v1

namespace dsg::cli {

std::vector<ListColumn> NodeColumns();
Row NodeRow(const v1::Node& node);

std::vector<ListColumn> EdgeColumns();
Row EdgeRow(const v1::Edge& edge);

/// When the edge held.
Interval HeldOf(const v1::Edge& edge);

}  // namespace dsg::cli
