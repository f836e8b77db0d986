// SPDX-License-Identifier: Apache-2.0
// Nodes one by one and as lists, with as much of each as the caller's view asks for.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"
#include "schema/codec/proto_convert.h"

namespace dsg::v1 {
class GetNodeRequest;
class GetNodeResponse;
class ListNodesRequest;
class ListNodesResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// `view` is a number of v1.NodeView. Errors: FIELD_INVALID for one that is not.
absl::Status CheckNodeView(int view);

/// Fills `out` with the parts of `node` that the view shows.
void FillNode(const Node& node, const LayerTable& layers, int view, v1::Node* out);

/// A node by id, or by a name that no other node has; `field` is the request's that says it.
/// Errors: NODE_UNKNOWN; FIELD_INVALID for nothing, and for a name that several nodes have.
absl::StatusOr<NodeId> ResolveOne(const Snapshot& snapshot, const std::string& id_or_name,
                                  std::string_view field, const StopCheck& stop);

absl::StatusOr<LayerTable> LayersOf(const Snapshot& snapshot);

absl::Status GetNode(const ReadView& view, const CallContext& call,
                     const v1::GetNodeRequest& request, v1::GetNodeResponse* reply);

absl::Status ListNodes(const Page& page, const CallContext& call,
                       const v1::ListNodesRequest& request, v1::ListNodesResponse* reply);

}  // namespace dsg::query
