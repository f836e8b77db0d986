// SPDX-License-Identifier: Apache-2.0
// Nodes one by one and as lists, with as much of each as the caller's view asks for.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"

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

}  // namespace dsg::query
