// SPDX-License-Identifier: Apache-2.0
// A node's edges with the nodes at their other ends, and many nodes by id in one call.
// Refuses to walk further: GetSubgraph does.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class BatchGetNodesRequest;
class BatchGetNodesResponse;
class GetNeighborsRequest;
class GetNeighborsResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status GetNeighbors(const Page& page, const CallContext& call,
                          const v1::GetNeighborsRequest& request, v1::GetNeighborsResponse* reply);

absl::Status BatchGetNodes(const ReadView& view, const CallContext& call,
                           const v1::BatchGetNodesRequest& request,
                           v1::BatchGetNodesResponse* reply);

}  // namespace dsg::query
