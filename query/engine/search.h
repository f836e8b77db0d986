// SPDX-License-Identifier: Apache-2.0
// Nodes by class, name, colour, attribute, relation and containment. Refuses to guess: a word that
// the map does not know is an error that lists what is near in spelling.
#pragma once

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/page_token.h"

namespace dsg::v1 {
class SearchNodesRequest;
class SearchNodesResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status SearchNodes(const Page& page, const CallContext& call,
                         const v1::SearchNodesRequest& request, v1::SearchNodesResponse* reply);

}  // namespace dsg::query
