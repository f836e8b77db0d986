// SPDX-License-Identifier: Apache-2.0
// Who picked or put which object, with the evidence for each candidate.
// Abstains where the evidence is weak: a guess would be worse than no answer.
#pragma once

#include "absl/status/status.h"
#include "query/engine/agent_names.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class ListInteractionsRequest;
class ListInteractionsResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status ListInteractions(const Page& page, AgentNames* names, const CallContext& call,
                              const v1::ListInteractionsRequest& request,
                              v1::ListInteractionsResponse* reply);

}  // namespace dsg::query
