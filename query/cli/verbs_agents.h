// SPDX-License-Identifier: Apache-2.0
// The verbs about agents: where, track, who.
#pragma once

#include <string>

#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"

namespace dsg::v1 {
class GetTrajectoryResponse;
class ListPresenceResponse;
class LocateAgentResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct WhereVerb {
  std::string agent;
  std::string at;
};

struct TrackVerb {
  std::string agent;
  std::string from;
  std::string to;
  /// A duration; empty = the stored poses.
  std::string every;
  PictureOptions picture;
};

struct WhoVerb {
  /// Exactly one of the two is set. A room, place or region by id or name.
  std::string room;
  std::string box;
  std::string from;
  std::string to;
};

/// One sentence. `room_name` may be empty.
std::string RenderLocation(const v1::LocateAgentResponse& reply, const TimeText& times,
                           const std::string& room_name);

/// One line per pose.
std::string RenderTrack(const v1::GetTrajectoryResponse& reply, const TimeText& times);

/// One line per stay, then the number of agents that were observed at all.
std::string RenderPresence(const v1::ListPresenceResponse& reply, const TimeText& times);

}  // namespace dsg::cli
