// SPDX-License-Identifier: Apache-2.0
// Where was an agent at an instant. Interpolated by the store, never extrapolated; nothing is
// added here but the stay that holds the instant and what stands above it.
#pragma once

#include "absl/status/status.h"
#include "query/engine/agent_names.h"
#include "query/engine/ancestry.h"
#include "query/engine/call_context.h"
#include "query/engine/read_view.h"

namespace dsg::v1 {
class BatchLocateAgentsRequest;
class BatchLocateAgentsResponse;
class LocateAgentRequest;
class LocateAgentResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status LocateAgent(const ReadView& view, AgentNames* names, AncestryCache* ancestries,
                         const v1::LocateAgentRequest& request, v1::LocateAgentResponse* reply);

/// Names are resolved once a batch. A pair that fails carries its own error.
absl::Status BatchLocateAgents(const ReadView& view, AgentNames* names, const CallContext& call,
                               const v1::BatchLocateAgentsRequest& request,
                               v1::BatchLocateAgentsResponse* reply);

}  // namespace dsg::query
