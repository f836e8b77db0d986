// SPDX-License-Identifier: Apache-2.0
// Reads the bodies of agents from a store or a server.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "query/cli/export/body.h"
#include "query/cli/session.h"

namespace dsg::v1 {
class GetAgentShapeRequest;
}

namespace dsg::cli {

/// What a reply says once.
struct BodySource {
  std::string agent_id;
  Revision revision = 0;
};

/// False when no more is needed.
using TakeBody = std::function<bool(const BodySource& source, Body body)>;

/// Calls `take` for each body that has a pose, ascending in time, without keeping them. The
/// request's parts decide what bodies have. `source` (may be null) is set, bodies or not.
/// Errors: of the call; DATA_LOSS for an asset that is no topology, or one of more vertices than
/// the body has.
absl::Status ReadBodies(const Session& session, const v1::GetAgentShapeRequest& request,
                        BodySource* source, const TakeBody& take);

/// The farthest that a body may be from the instant that it is shown at: half the map's gap, within
/// which a track that goes on has one.
TimeNs BodyReachNs(const Session& session);

/// The body nearest to an instant, the earlier of two; nullopt if none is within BodyReachNs.
/// Interval and parts of `request` are set here. Errors: of ReadBodies.
absl::StatusOr<std::optional<Body>> ReadBodyAt(const Session& session,
                                               v1::GetAgentShapeRequest request, TimeNs at_ns);

}  // namespace dsg::cli
