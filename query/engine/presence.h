// SPDX-License-Identifier: Apache-2.0
// Who was in a room, a place, a region or a box during an interval. Absence is only reported for
// agents that were observed at all, which is why their number stands beside the answer.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class ListPresenceRequest;
class ListPresenceResponse;
}  // namespace dsg::v1

namespace dsg::query {

/// The request's own fields, checked before a map is opened.
absl::Status CheckListPresence(const v1::ListPresenceRequest& request);

absl::Status ListPresence(const Page& page, const CallContext& call,
                          const v1::ListPresenceRequest& request, v1::ListPresenceResponse* reply);

}  // namespace dsg::query
