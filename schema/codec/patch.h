// SPDX-License-Identifier: Apache-2.0
// Changes of some fields of nodes and edges, as clients send them: what they do not name stays as
// it is stored.
#pragma once

#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "schema/codec/proto_convert.h"

namespace dsg {

/// What is stored of a node or an edge; nullopt if nothing is.
struct PatchSource {
  std::function<absl::StatusOr<std::optional<Node>>(NodeId)> find_node;
  std::function<absl::StatusOr<std::optional<Edge>>(const EdgeKey&)> find_edge;
};

/// Turns the patches of a delta into whole nodes and edges of it. A patch of what the delta brings
/// itself changes that; one of what is nowhere makes it.
///
/// Without a mask a field counts that is set in the patch: a message whole, but for the components
/// (object, agent, ...), of which again the fields count that are set; entries of attributes one by
/// one; numbers and texts that have no presence when they are not 0 and not empty. With a mask its
/// paths count, whether or not the patch sets them.
///
/// Errors: INVALID_ARGUMENT, as FromProto of a node or edge; NOT_FOUND/LAYER_UNKNOWN; what `source`
/// returns.
absl::Status ApplyPatches(const LayerTable& layers, const PatchSource& source, GraphDelta* delta);

/// Says of the nodes and edges of a delta, but for those with a mask, that they are whole.
void MarkWhole(v1::GraphDelta* delta);

}  // namespace dsg
