// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_agents.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/agent_pictures.h"
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {
namespace {

std::string LocatedPoseText(const v1::LocateAgentResponse& reply, const TimeText& times) {
  if (reply.quality() == v1::IN_GAP) {
    return absl::StrCat("not observed: the track has a gap from ",
                        times.Relative(reply.before_ns()), " to ",
                        times.Relative(reply.after_ns()));
  }
  const v1::Vector3& p = reply.pose().position();
  std::string text =
      absl::StrCat("x ", Fixed(p.x(), 2), " y ", Fixed(p.y(), 2), " z ", Fixed(p.z(), 2), " m");
  if (!reply.orientation_unknown()) {
    absl::StrAppend(&text, ", yaw ", Fixed(YawDeg(reply.pose()), 1), " deg");
  }
  if (reply.quality() == v1::EXACT) return text + ", measured";
  return absl::StrCat(text, ", interpolated between ", times.Relative(reply.before_ns()), " and ",
                      times.Relative(reply.after_ns()));
}

std::string WhereaboutsText(const v1::LocateAgentResponse& reply, const std::string& room_name) {
  std::vector<std::string> parts;
  if (!reply.place_id().empty()) parts.push_back("place " + reply.place_id());
  if (!reply.room_id().empty()) {
    parts.push_back(absl::StrCat("room ", reply.room_id(),
                                 room_name.empty() ? "" : absl::StrCat(" \"", room_name, "\"")));
  }
  if (!reply.building_id().empty()) parts.push_back("building " + reply.building_id());
  return parts.empty() ? "in no known place" : absl::StrJoin(parts, ", ");
}

std::string FlagsText(uint32_t flags) {
  std::vector<std::string> words;
  if (flags & pose_flags::kCorrected) words.push_back("corrected");
  if (flags & pose_flags::kPredicted) words.push_back("predicted");
  return absl::StrJoin(words, ",");
}

}  // namespace

std::string RenderLocation(const v1::LocateAgentResponse& reply, const TimeText& times,
                           const std::string& room_name) {
  return Printable(absl::StrCat(
             NamedId(reply.agent_id(), reply.agent_name()), " at ", times.Full(reply.at_ns()),
             " (revision ", reply.header().read_revision(), "): ", LocatedPoseText(reply, times),
             "; ", WhereaboutsText(reply, room_name))) +
         "\n";
}

std::vector<ListColumn> PoseColumns() {
  return {{"time", CellType::kTime},
          {"x m", CellType::kReal, 3},
          {"y m", CellType::kReal, 3},
          {"z m", CellType::kReal, 3},
          {"yaw deg", CellType::kReal, 1, "-"},
          {"note"},
          {"date", CellType::kDate}};
}

absl::Status AddPoses(const v1::GetTrajectoryResponse& part, ListWriter* list) {
  return list->Add(part, part.poses(), [](const v1::TimedPose& pose) {
    const v1::Vector3& p = pose.pose().position();
    const bool has_yaw = (pose.flags() & pose_flags::kNoOrientation) == 0;
    return Row{pose.time_ns(),
               p.x(),
               p.y(),
               p.z(),
               has_yaw ? Cell(YawDeg(pose.pose())) : Cell(),
               FlagsText(pose.flags()),
               pose.time_ns()};
  });
}

std::vector<ListColumn> StayColumns() {
  return {{"agent"},
          {"name"},
          {"enter", CellType::kTime},
          {"exit", CellType::kTime},
          {"stayed", CellType::kDuration},
          {"in"},
          {"date", CellType::kDate}};
}

absl::Status AddStays(const v1::ListPresenceResponse& part, ListWriter* list) {
  return list->Add(part, part.intervals(), [](const v1::PresenceInterval& stay) {
    return Row{stay.agent_id(),
               stay.agent_name(),
               stay.enter_ns(),
               stay.exit_ns(),
               LengthNs(stay.enter_ns(), stay.exit_ns()),
               stay.node_id(),
               stay.enter_ns()};
  });
}

std::string ObservedFooter(const std::string& counted, int64_t observed_agent_count,
                           const PageEnd& end) {
  return absl::StrCat(counted, "; ", Counted(observed_agent_count, "agent"),
                      " observed anywhere in that time (revision ", end.revision, ")",
                      end.is_cut ? "; there are more, see --limit" : "", "\n");
}

std::string TrackFooter(int64_t pose_count, const v1::GetTrajectoryResponse& first) {
  return absl::StrCat(Counted(pose_count, "pose"), " of ", first.agent_id(), " (revision ",
                      first.header().read_revision(), ")\n");
}

namespace {

// The name of the room at the revision of the answer; "" without one.
absl::StatusOr<std::string> RoomName(Session* session, const v1::LocateAgentResponse& located) {
  if (located.room_id().empty()) return std::string();
  auto request = session->Begin<v1::GetNodeRequest>();
  request.mutable_read_at()->set_exact_revision(located.header().read_revision());
  request.set_id(located.room_id());
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  return reply.node().name();
}

absl::Status RunWhere(Session* session, const WhereVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  auto request = session->Begin<v1::LocateAgentRequest>();
  request.set_agent(verb.agent);
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
  request.set_at_ns(at_ns);
  v1::LocateAgentResponse reply;
  DSG_RETURN_IF_ERROR(session->api().LocateAgent(session->NewCall(), request, &reply));
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, DrawLocation(*session, reply));
  }
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    DSG_ASSIGN_OR_RETURN(const std::string room_name, RoomName(session, reply));
    out << RenderLocation(reply, session->times(), room_name);
  }
  return WritePicture(session, verb.picture, picture, out);
}

absl::Status RunTrack(Session* session, const TrackVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  auto request = session->Begin<v1::GetTrajectoryRequest>();
  request.set_agent(verb.agent);
  const MapSpec& map = session->map();
  DSG_RETURN_IF_ERROR(
      SetInstant("--from", verb.from, map, &request, &v1::GetTrajectoryRequest::set_from_ns));
  DSG_RETURN_IF_ERROR(
      SetInstant("--to", verb.to, map, &request, &v1::GetTrajectoryRequest::set_to_ns));
  DSG_RETURN_IF_ERROR(SetDuration("--every", verb.every, &request,
                                  &v1::GetTrajectoryRequest::set_resample_period_ns));
  // The list is written as it arrives; a picture needs all poses.
  const bool is_kept = !verb.picture.png.empty();
  ListWriter list(session->common(), session->times(), "poses", PoseColumns(), &out);
  v1::GetTrajectoryResponse kept;
  v1::GetTrajectoryResponse first;
  int64_t poses_left = EntriesLeft(session->common().limit);
  absl::Status written;
  const auto take = [&](v1::GetTrajectoryResponse message) {
    CutToLimit(message.mutable_poses(), &poses_left);
    written = AddPoses(message, &list);
    if (is_kept) kept.MergeFrom(message);
    message.clear_poses();
    // The first message has header and agent.
    first.MergeFrom(message);
    return written.ok() && poses_left > 0;
  };
  DSG_RETURN_IF_ERROR(session->Read(&query::Api::GetTrajectory, request, take));
  DSG_RETURN_IF_ERROR(written);
  DSG_RETURN_IF_ERROR(list.End(TrackFooter(list.count(), first)));
  if (!is_kept) return absl::OkStatus();
  return WritePicture(session, verb.picture, DrawTrack(*session, kept, verb.agent), out);
}

absl::Status RunWho(Session* session, const WhoVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  auto request = session->Begin<v1::ListPresenceRequest>();
  if (verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const std::string node_id, RegionId(session, verb.room));
    request.set_node_id(node_id);
  } else {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--box", verb.box));
    ToProto(box, request.mutable_box());
  }
  DSG_ASSIGN_OR_RETURN(const Interval asked, AskedInterval(session, verb.from, verb.to));
  request.set_from_ns(asked.from_ns);
  request.set_to_ns(asked.to_ns);
  ListWriter list(session->common(), session->times(), "intervals", StayColumns(), &out);
  PageEnd end;
  int64_t observed_count = 0;
  v1::ListPresenceResponse kept;
  const auto take = [&](const v1::ListPresenceResponse& page) {
    if (!verb.picture.png.empty()) kept.MergeFrom(page);
    end = PageEnd::Of(page);
    observed_count = page.observed_agent_count();
    return AddStays(page, &list);
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::ListPresence, request, session->common().limit,
                                        &v1::ListPresenceResponse::intervals_size, take));
  DSG_RETURN_IF_ERROR(list.End(ObservedFooter(Counted(list.count(), "stay"), observed_count, end)));
  if (verb.picture.png.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const AnswerPicture picture, DrawPresence(*session, request, kept));
  return WritePicture(session, verb.picture, picture, out);
}

absl::Status CheckWho(const WhoVerb& verb, const CommonOptions&) {
  if (!verb.room.empty() || !verb.box.empty()) return absl::OkStatus();
  return Usage("who asks about one place: give --room ID or --box X0,Y0,Z0,X1,Y1,Z1", "who");
}

void AddTrack(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<TrackVerb>(
      {.name = "track",
       .what = "The poses of an agent",
       .example = "carol --from +30s --to +32s --every 500ms --png carol.png",
       .takes = kQuestion | kLimit | kFormat,
       .run = RunTrack});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--from", verb->from, "First TIME; default the first pose of the track");
  app->add_option("--to", verb->to, "TIME to stop before; default after the last pose");
  app->add_option("--every", verb->every, "Interpolate at this period: 0.5s, 200ms");
  AddPicture(app, "the track", &verb->picture);
}

void AddWho(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<WhoVerb>({.name = "who",
                                                  .what = "Who was in a room or a box, and when",
                                                  .example = "--room kitchen --from +1m --to +2m",
                                                  .takes = kQuestion | kLimit | kFormat,
                                                  .run = RunWho,
                                                  .check = CheckWho});
  CLI::Option* room =
      app->add_option("--room", verb->room,
                      "Room, place or region, by id (R2) or name; or the only room of a class");
  CLI::Option* box =
      app->add_option("--box", verb->box, "X0,Y0,Z0,X1,Y1,Z1 in the map frame, metres");
  room->excludes(box);
  app->add_option("--from", verb->from, kMapFromHelp);
  app->add_option("--to", verb->to, kMapToHelp);
  AddPicture(app, "the place and the ways of those who were there", &verb->picture);
}

}  // namespace

void AddAgentVerbs(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<WhereVerb>({.name = "where",
                                                    .what = "Where an agent was at an instant",
                                                    .example = "carol --at +100.25s",
                                                    .run = RunWhere});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--at", verb->at, "TIME asked about")->required();
  AddPicture(app, "the agent and its way", &verb->picture);
  AddTrack(grammar);
  AddWho(grammar);
}

}  // namespace dsg::cli
