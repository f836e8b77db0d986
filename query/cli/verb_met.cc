// SPDX-License-Identifier: Apache-2.0
// The verb met: who came near whom, when and where.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/asked_interval.h"
#include "query/cli/export/palette.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/paging.h"
#include "query/cli/render_meetings.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

std::string ShortName(const std::string& id, const std::string& name) {
  return name.empty() ? id : name;
}

// Both names, or the other one where the question names one.
std::string LabelOf(const v1::Encounter& meeting, const MetVerb& verb) {
  const std::string name = ShortName(meeting.agent_id(), meeting.agent_name());
  const std::string other = ShortName(meeting.other_agent_id(), meeting.other_agent_name());
  if (verb.agent == meeting.agent_id() || verb.agent == meeting.agent_name()) return other;
  const bool asked_other =
      verb.agent == meeting.other_agent_id() || verb.agent == meeting.other_agent_name();
  return asked_other ? name : absl::StrCat(name, " & ", other);
}

// Both ways while they were near one another, and where they were nearest.
absl::StatusOr<AnswerPicture> Draw(Session* session, const v1::ListEncountersResponse& reply,
                                   const MetVerb& verb) {
  // More ways would be a scribble; later meetings are marks only.
  constexpr int kWayCountMax = 20;
  AnswerPicture picture{.title = absl::StrCat(reply.encounters_size(), " meetings"),
                        .revision = reply.header().read_revision()};
  std::vector<std::string> agents;
  const auto color_of = [&](const std::string& id, const std::string& name) {
    const auto found = std::find(agents.begin(), agents.end(), id);
    const auto index = static_cast<size_t>(found - agents.begin());
    if (found == agents.end()) {
      agents.push_back(id);
      picture.overlay.legend.push_back({ShortName(id, name), AgentColor(index)});
    }
    return AgentColor(index);
  };
  for (int i = 0; i < reply.encounters_size(); ++i) {
    const v1::Encounter& meeting = reply.encounters(i);
    const uint32_t rgb = color_of(meeting.agent_id(), meeting.agent_name());
    const uint32_t other_rgb = color_of(meeting.other_agent_id(), meeting.other_agent_name());
    for (const auto& [id, line_rgb] :
         {std::pair(meeting.agent_id(), rgb), std::pair(meeting.other_agent_id(), other_rgb)}) {
      if (i >= kWayCountMax) break;
      DSG_ASSIGN_OR_RETURN(const auto pieces, WayOf(session, id, picture.revision,
                                                    {meeting.from_ns(), meeting.to_ns()}));
      for (const auto& piece : pieces) picture.overlay.lines.push_back({piece, line_rgb});
    }
    picture.overlay.marks.push_back({.position_map = PointOf(meeting.position()),
                                     .rgb = rgb,
                                     .shape = OverlayMark::Shape::kRing,
                                     .label = LabelOf(meeting, verb)});
  }
  return picture;
}

absl::StatusOr<v1::ListEncountersRequest> RequestFor(Session* session, const MetVerb& verb) {
  auto request = session->Begin<v1::ListEncountersRequest>();
  request.set_agent(verb.agent);
  request.set_other_agent(verb.other_agent);
  DSG_ASSIGN_OR_RETURN(const Interval asked, AskedInterval(session, verb.from, verb.to));
  request.set_from_ns(asked.from_ns);
  request.set_to_ns(asked.to_ns);
  request.set_distance_m(verb.within_m);
  if (!verb.for_at_least.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs duration_ns, ParseDuration("--for", verb.for_at_least));
    request.set_duration_ns_min(duration_ns);
  }
  request.set_line_of_sight(verb.line_of_sight);
  if (!verb.sight_gap.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs gap_ns, ParseDuration("--sight-gap", verb.sight_gap));
    request.set_sight_gap_ns_max(gap_ns);
  }
  return request;
}

}  // namespace

absl::Status RunMet(Session* session, const MetVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::ListEncountersRequest request, RequestFor(session, verb));
  v1::ListEncountersResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::ListEncountersResponse& page) { return page.encounters_size(); },
      [&](const v1::ListEncountersRequest& next, v1::ListEncountersResponse* page) {
        return session->api().ListEncounters(session->NewCall(), next, page);
      },
      &all));
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, Draw(session, all, verb));
  }
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(all, out));
  } else {
    std::vector<std::string> ids;
    for (const v1::Encounter& meeting : all.encounters()) {
      ids.insert(ids.end(), {meeting.room_id(), meeting.place_id()});
    }
    DSG_ASSIGN_OR_RETURN(const NodeNames names,
                         NamesOf(session, all.header().read_revision(), ids));
    out << RenderEncounters(all, session->times(), names);
  }
  return WritePicture(session, verb.picture, picture, out);
}

}  // namespace dsg::cli
