// SPDX-License-Identifier: Apache-2.0
// All that can be reached from a node, as a stream: nodes by distance, then the edges between them.
// Refuses to hold a filled message longer than it takes to send it.
#pragma once

#include <memory>

#include "query/engine/service_core.h"

namespace dsg::query {

class ReadView;

/// Errors: NODE_UNKNOWN; those of FilterFromProto.
absl::StatusOr<std::unique_ptr<SubgraphCursor>> OpenSubgraph(const ReadView& view,
                                                             const v1::GetSubgraphRequest& request);

}  // namespace dsg::query
