// SPDX-License-Identifier: Apache-2.0
// Edges as a list, narrowed by either end, relation and instant of world time.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class ListEdgesRequest;
class ListEdgesResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// The CONTAINS edges that lead down from a node.
EdgeFilter ChildrenOf(NodeId parent);

absl::Status ListEdges(const Page& page, const CallContext& call,
                       const v1::ListEdgesRequest& request, v1::ListEdgesResponse* reply);

}  // namespace dsg::query
