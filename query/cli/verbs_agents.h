// SPDX-License-Identifier: Apache-2.0
// The verbs about agents: where, track, who.
#pragma once

#include <string>
#include <vector>

#include "query/cli/answer_text.h"
#include "query/cli/arguments.h"
#include "query/cli/list_writer.h"

namespace dsg::v1 {
class GetTrajectoryResponse;
class ListPresenceResponse;
class LocateAgentResponse;
}  // namespace dsg::v1

namespace dsg::cli {

struct WhereVerb {
  std::string agent;
  std::string at;
  PictureOptions picture;
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
  PictureOptions picture;
};

/// One sentence. `room_name` may be empty.
std::string RenderLocation(const v1::LocateAgentResponse& reply, const TimeText& times,
                           const std::string& room_name);

/// A row per pose of a track; `list` has PoseColumns.
std::vector<ListColumn> PoseColumns();
absl::Status AddPoses(const v1::GetTrajectoryResponse& part, ListWriter* list);
/// `first`: the part with the header.
std::string TrackFooter(int64_t pose_count, const v1::GetTrajectoryResponse& first);

/// A row per stay; `list` has StayColumns.
std::vector<ListColumn> StayColumns();
absl::Status AddStays(const v1::ListPresenceResponse& part, ListWriter* list);

/// "2 stays; 7 agents observed anywhere in that time (revision 6)".
std::string ObservedFooter(const std::string& counted, int64_t observed_agent_count,
                           const PageEnd& end);

}  // namespace dsg::cli
