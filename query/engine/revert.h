// SPDX-License-Identifier: Apache-2.0
// A map made what it was at a revision, as new revisions, a batch a message.
// Refuses to lose what was believed since: the revisions between stay readable.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

/// Layers and labels that came later stay, without nodes; assets stay too.
/// Errors: MAP_UNKNOWN, TAG_UNKNOWN, REVISION_IN_FUTURE, REVISION_COMPACTED.
absl::StatusOr<std::unique_ptr<RevertCursor>> OpenRevert(MapTable* maps,
                                                         const v1::RevertRequest& request);

}  // namespace dsg::query
