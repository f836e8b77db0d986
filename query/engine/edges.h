// SPDX-License-Identifier: Apache-2.0
// Edges as a list, narrowed by either end, relation and instant of world time.
#pragma once

#include "schema/store/snapshot.h"

namespace dsg::query {

/// The CONTAINS edges that lead down from a node.
EdgeFilter ChildrenOf(NodeId parent);

}  // namespace dsg::query
