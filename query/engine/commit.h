// SPDX-License-Identifier: Apache-2.0
// The way in over the service: one delta, translated with the map's own layers and handed to the
// map's writer, which alone decides whether it is valid.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "query/engine/call_context.h"
#include "query/engine/map_table.h"

namespace dsg::v1 {
class CommitRequest;
class CommitResponse;
class GetSessionRequest;
class GetSessionResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status Commit(MapTable* maps, const CallContext& call, const v1::CommitRequest& request,
                    v1::CommitResponse* reply);
/// A session for the deltas of one piece of the engine's own work, such as a prune: deltas are
/// known by session and sequence, so no two pieces may share one, in any process.
std::string NewSessionId(std::string_view work);

absl::Status GetSession(MapTable* maps, const v1::GetSessionRequest& request,
                        v1::GetSessionResponse* reply);

}  // namespace dsg::query
