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
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
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

// Only maps with dates have this column.
void AddDateColumn(const TimeText& times, std::vector<Column>* columns) {
  if (times.has_dates()) columns->push_back({"date"});
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

std::string RenderTrack(const v1::GetTrajectoryResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"time", Align::kRight},    {"x m", Align::kRight},
                              {"y m", Align::kRight},     {"z m", Align::kRight},
                              {"yaw deg", Align::kRight}, {"note"}};
  AddDateColumn(times, &columns);
  Table table(columns);
  for (const v1::TimedPose& pose : reply.poses()) {
    const v1::Vector3& p = pose.pose().position();
    const bool has_yaw = (pose.flags() & pose_flags::kNoOrientation) == 0;
    std::vector<std::string> cells{times.Relative(pose.time_ns()),
                                   Fixed(p.x(), 3),
                                   Fixed(p.y(), 3),
                                   Fixed(p.z(), 3),
                                   has_yaw ? Fixed(YawDeg(pose.pose()), 1) : "-",
                                   FlagsText(pose.flags())};
    if (times.has_dates()) cells.push_back(times.Date(pose.time_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.poses_size(), "pose"), " of ", reply.agent_id(),
                      " (revision ", reply.header().read_revision(), ")\n");
}

std::string RenderPresence(const v1::ListPresenceResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"agent"},
                              {"name"},
                              {"enter", Align::kRight},
                              {"exit", Align::kRight},
                              {"stayed", Align::kRight},
                              {"in"}};
  AddDateColumn(times, &columns);
  Table table(columns);
  for (const v1::PresenceInterval& stay : reply.intervals()) {
    std::vector<std::string> cells{stay.agent_id(),
                                   stay.agent_name(),
                                   times.Relative(stay.enter_ns()),
                                   times.Relative(stay.exit_ns()),
                                   DurationText(stay.enter_ns(), stay.exit_ns()),
                                   stay.node_id()};
    if (times.has_dates()) cells.push_back(times.Date(stay.enter_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.intervals_size(), "stay"), "; ",
                      Counted(reply.observed_agent_count(), "agent"),
                      " observed anywhere in that time (revision ", reply.header().read_revision(),
                      ")", reply.next_page_token().empty() ? "" : "; there are more, see --limit",
                      "\n");
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

AnswerPicture DrawTrack(const v1::GetTrajectoryResponse& track, const Session& session,
                        const std::string& agent) {
  constexpr uint32_t kTrackRgb = 0x1f5fbf;
  AnswerPicture picture{.title = agent, .revision = track.header().read_revision()};
  if (track.poses().empty()) return picture;
  const v1::TimedPose& first = track.poses(0);
  const v1::TimedPose& last = track.poses(track.poses_size() - 1);
  // A tenth of a second is finer than the picture.
  const std::string begin = session.times().Tenth(first.time_ns());
  const std::string end = session.times().Tenth(last.time_ns());
  absl::StrAppend(&picture.title, "  ", begin, " to ", end);
  picture.at_ns = last.time_ns();
  Overlay& overlay = picture.overlay;
  TimeNs before_ns = kTimeMin;
  for (const v1::TimedPose& pose : track.poses()) {
    const bool begins =
        overlay.lines.empty() || pose.time_ns() - before_ns > session.map().gap_ns_max;
    if (begins) overlay.lines.push_back({.points_map = {}, .rgb = kTrackRgb, .width_px = 5.0});
    overlay.lines.back().points_map.push_back(PointOf(pose.pose().position()));
    before_ns = pose.time_ns();
  }
  overlay.marks = {
      {.position_map = PointOf(first.pose().position()),
       .rgb = kTrackRgb,
       .shape = OverlayMark::Shape::kRing,
       .label = begin},
      {.position_map = PointOf(last.pose().position()), .rgb = kTrackRgb, .label = end}};
  return picture;
}

absl::Status RunWhere(Session* session, const WhereVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::LocateAgentRequest>();
  request.set_agent(verb.agent);
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
  request.set_at_ns(at_ns);
  v1::LocateAgentResponse reply;
  DSG_RETURN_IF_ERROR(
      session->times().Explain(session->api().LocateAgent(session->NewCall(), request, &reply)));
  if (session->common().json) return WriteJson(reply, out);
  DSG_ASSIGN_OR_RETURN(const std::string room_name, RoomName(session, reply));
  out << RenderLocation(reply, session->times(), room_name);
  return absl::OkStatus();
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
  // JSON is written as it arrives; a table or a picture needs all poses.
  const bool is_json = session->common().json;
  const bool is_kept = !is_json || !verb.picture.png.empty();
  JsonListWriter json("poses", &out);
  v1::GetTrajectoryResponse all;
  int64_t poses_left = EntriesLeft(session->common().limit);
  absl::Status written;
  const auto take = [&](v1::GetTrajectoryResponse message) {
    if (message.poses_size() > poses_left) {
      message.mutable_poses()->DeleteSubrange(static_cast<int>(poses_left),
                                              message.poses_size() - static_cast<int>(poses_left));
    }
    poses_left -= message.poses_size();
    if (is_json) written = json.Add(message);
    // The first message has header and agent, all have poses.
    if (is_kept) all.MergeFrom(message);
    return written.ok() && poses_left > 0;
  };
  DSG_RETURN_IF_ERROR(
      session->times().Explain(session->Read(&query::Api::GetTrajectory, request, take)));
  DSG_RETURN_IF_ERROR(written);
  if (is_json) {
    json.End();
  } else {
    out << RenderTrack(all, session->times());
  }
  if (verb.picture.png.empty()) return absl::OkStatus();
  return WritePicture(session, verb.picture, DrawTrack(all, *session, verb.agent), out);
}

absl::Status RunWho(Session* session, const WhoVerb& verb, std::ostream& out) {
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
  v1::ListPresenceResponse all;
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::ListPresence, request,
                                         session->common().limit,
                                         &v1::ListPresenceResponse::intervals_size, &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderPresence(all, session->times());
  return absl::OkStatus();
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
       .takes = kQuestion | kLimit,
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
                                                  .takes = kQuestion | kLimit,
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
}

}  // namespace

void AddAgentVerbs(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<WhereVerb>({.name = "where",
                                                    .what = "Where an agent was at an instant",
                                                    .example = "carol --at +100.25s",
                                                    .run = RunWhere});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--at", verb->at, "TIME asked about")->required();
  AddTrack(grammar);
  AddWho(grammar);
}

}  // namespace dsg::cli
