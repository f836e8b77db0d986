// SPDX-License-Identifier: Apache-2.0
// Makes the agents of a ready-made graph agents of the map: the same name is the same agent.
#pragma once

#include "absl/status/status.h"
#include "ingest/pipeline/agent_namer.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Gives each agent of `delta` the id that `namer` has for its name, its own if that is free, in
/// every part of the delta.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED when two agents of the graph share name and kind.
absl::Status RenameAgents(AgentNamer* namer, GraphDelta* delta);

}  // namespace dsg::ingest
