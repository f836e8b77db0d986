// SPDX-License-Identifier: Apache-2.0
// The verbs about agents: where, track, who.
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/asked_interval.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/paging.h"
#include "query/cli/render_agents.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

// The name of a room at the revision that named it; "" without one.
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
  // To the tenth, which is more than a picture shows.
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

}  // namespace

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
  if (!verb.from.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs from_ns, ParseInstant("--from", verb.from, map));
    request.set_from_ns(from_ns);
  }
  if (!verb.to.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs to_ns, ParseInstant("--to", verb.to, map));
    request.set_to_ns(to_ns);
  }
  if (!verb.every.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs period_ns, ParseDuration("--every", verb.every));
    request.set_resample_period_ns(period_ns);
  }
  // JSON is written as it comes; a table or a picture is made of the whole.
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
    // Header and agent stand in the first, poses in all.
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
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::ListPresenceResponse& page) { return page.intervals_size(); },
      [&](const v1::ListPresenceRequest& next, v1::ListPresenceResponse* page) {
        return session->api().ListPresence(session->NewCall(), next, page);
      },
      &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderPresence(all, session->times());
  return absl::OkStatus();
}

}  // namespace dsg::cli
