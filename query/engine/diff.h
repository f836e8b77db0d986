// SPDX-License-Identifier: Apache-2.0
// What differs between two revisions of a map: nodes, edges, tracks, mesh blocks.
// Refuses to tell the steps between them: a node that came and went is not there.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/map_table.h"

namespace dsg::v1 {
class DiffRevisionsRequest;
class DiffRevisionsResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// Errors: MAP_UNKNOWN, REVISION_IN_FUTURE, REVISION_COMPACTED, LAYER_UNKNOWN, FIELD_INVALID,
/// PAGE_TOKEN_MISMATCH.
absl::Status DiffRevisions(MapTable* maps, const CallContext& call,
                           const v1::DiffRevisionsRequest& request,
                           v1::DiffRevisionsResponse* reply);

}  // namespace dsg::query
