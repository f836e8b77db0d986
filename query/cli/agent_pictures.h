// SPDX-License-Identifier: Apache-2.0
// Where agents were, drawn on the map: a position, a track, the stays in a place.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "query/cli/answer_picture.h"
#include "query/cli/session.h"

namespace dsg::v1 {
class GetTrajectoryResponse;
class ListPresenceRequest;
class ListPresenceResponse;
class LocateAgentResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// The agent with its direction, the ellipse of one standard deviation if the log gave one, and its
/// way of ten seconds before and after. In a gap, the poses at both ends of it.
absl::StatusOr<AnswerPicture> DrawLocation(const Session& session,
                                           const v1::LocateAgentResponse& reply);

/// A track from a ring to a dot, with the times of both. `agent`: as asked for.
AnswerPicture DrawTrack(const Session& session, const v1::GetTrajectoryResponse& track,
                        const std::string& agent);

/// The room, place or box, and in the colour of each agent its ways while it was there. Of a region
/// above rooms only the ways.
absl::StatusOr<AnswerPicture> DrawPresence(const Session& session,
                                           const v1::ListPresenceRequest& request,
                                           const v1::ListPresenceResponse& reply);

}  // namespace dsg::cli
