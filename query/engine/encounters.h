// SPDX-License-Identifier: Apache-2.0
// Who was within a distance of whom, from the exact roots of the distance between two moving
// points. Refuses to bridge gaps: where one of the two was not seen nothing is claimed.
#pragma once

#include "absl/status/status.h"
#include "query/engine/agent_names.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class ListEncountersRequest;
class ListEncountersResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status ListEncounters(const Page& page, AgentNames* names, const CallContext& call,
                            const v1::ListEncountersRequest& request,
                            v1::ListEncountersResponse* reply);

}  // namespace dsg::query
