// SPDX-License-Identifier: Apache-2.0
// Answers about agents as text for people. Only turns replies into words: asks nothing.
#pragma once

#include <string>

#include "query/cli/time_text.h"

namespace dsg::v1 {
class GetTrajectoryResponse;
class ListPresenceResponse;
class LocateAgentResponse;
class Pose;
}  // namespace dsg::v1

namespace dsg::cli {

/// Rotation about the map's z axis, degrees in (-180, 180].
double YawDeg(const v1::Pose& pose);

/// One sentence. `room_name` may be empty.
std::string RenderLocation(const v1::LocateAgentResponse& reply, const TimeText& times,
                           const std::string& room_name);

/// A line a pose.
std::string RenderTrack(const v1::GetTrajectoryResponse& reply, const TimeText& times);

/// A line a presence, then who was observed at all.
std::string RenderPresence(const v1::ListPresenceResponse& reply, const TimeText& times);

}  // namespace dsg::cli
