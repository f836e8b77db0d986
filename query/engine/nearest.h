// SPDX-License-Identifier: Apache-2.0
// The nodes nearest to a point. Agents move, so they are looked at only when they are asked for
// together with an instant, and then stand where their track puts them.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/read_view.h"

namespace dsg::v1 {
class ListNearestNodesRequest;
class ListNearestNodesResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// Cost: an index lookup in the revision's view, which the first question of a revision has to make
/// (about a second for 100,000 nodes, a few milliseconds from the view of a revision close by); for
/// agents, one Locate an agent and no view.
absl::Status ListNearestNodes(const ReadView& view, const CallContext& call,
                              const v1::ListNearestNodesRequest& request,
                              v1::ListNearestNodesResponse* reply);

}  // namespace dsg::query
