// SPDX-License-Identifier: Apache-2.0
// Where an agent will be, from its track and the places that people walk to.
// Refuses to look at anything after the instant that it predicts from.
#pragma once

#include "absl/status/status.h"
#include "query/engine/agent_names.h"
#include "query/engine/call_context.h"
#include "query/engine/read_view.h"
#include "query/engine/walk_area_cache.h"

namespace dsg::v1 {
class PredictAgentRequest;
class PredictAgentResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status PredictAgent(const ReadView& view, AgentNames* names, WalkAreaCache* areas,
                          const CallContext& call, const v1::PredictAgentRequest& request,
                          v1::PredictAgentResponse* reply);

}  // namespace dsg::query
