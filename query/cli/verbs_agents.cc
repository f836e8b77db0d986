// SPDX-License-Identifier: Apache-2.0
// The verbs about agents: where, track, who.
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/json.h"
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

// The span of all poses at the revision asked for; open where there are none.
absl::StatusOr<Interval> PoseSpan(Session* session) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  Interval span;
  if (reply.has_first_pose_ns()) span.from_ns = reply.first_pose_ns();
  // Half-open, yet the last pose belongs to the span.
  if (reply.has_last_pose_ns() && reply.last_pose_ns() < kTimeMax) {
    span.to_ns = reply.last_pose_ns() + 1;
  }
  return span;
}

absl::StatusOr<Interval> AskedInterval(Session* session, const WhoVerb& verb) {
  Interval asked;
  if (verb.from.empty() || verb.to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked, PoseSpan(session));
  }
  const TimeNs epoch_ns = session->map().epoch_ns;
  if (!verb.from.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.from_ns, ParseInstant("--from", verb.from, epoch_ns));
  }
  if (!verb.to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.to_ns, ParseInstant("--to", verb.to, epoch_ns));
  }
  return asked;
}

// Rooms of this name; the id of the only one, or "" if there is none.
absl::StatusOr<std::string> RoomByName(Session* session, const std::string& name) {
  auto request = session->Begin<v1::ListNodesRequest>();
  request.mutable_filter()->set_name(name);
  request.mutable_filter()->set_kind(kinds::kRoom);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::ListNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNodes(session->NewCall(), request, &reply));
  if (reply.nodes().empty()) return std::string();
  if (reply.nodes_size() == 1) return reply.nodes(0).id();
  std::string ids;
  for (const v1::Node& room : reply.nodes()) absl::StrAppend(&ids, " ", room.id());
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("several rooms are called \"", name, "\"; name one by its id:", ids),
      {{"field", "--room"}, {"value", name}});
}

// ListPresence takes ids only. GetNode knows ids and names, but a name may be shared: by several
// rooms, or by a room and the furniture in it. Then the room is meant.
absl::StatusOr<std::string> RegionId(Session* session, const std::string& id_or_name) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(id_or_name);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNodeResponse reply;
  const absl::Status found = session->api().GetNode(session->NewCall(), request, &reply);
  if (found.ok() && reply.node().id() == id_or_name) return id_or_name;
  if (!found.ok() && !absl::IsNotFound(found) && !absl::IsInvalidArgument(found)) return found;
  DSG_ASSIGN_OR_RETURN(const std::string room_id, RoomByName(session, id_or_name));
  if (!room_id.empty()) return room_id;
  if (!found.ok()) return found;
  return reply.node().id();
}

}  // namespace

absl::Status RunWhere(Session* session, const WhereVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::LocateAgentRequest>();
  request.set_agent(verb.agent);
  DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map().epoch_ns));
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
  auto request = session->Begin<v1::GetTrajectoryRequest>();
  request.set_agent(verb.agent);
  const TimeNs epoch_ns = session->map().epoch_ns;
  if (!verb.from.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs from_ns, ParseInstant("--from", verb.from, epoch_ns));
    request.set_from_ns(from_ns);
  }
  if (!verb.to.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs to_ns, ParseInstant("--to", verb.to, epoch_ns));
    request.set_to_ns(to_ns);
  }
  if (!verb.every.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs period_ns, ParseDuration("--every", verb.every));
    request.set_resample_period_ns(period_ns);
  }
  // The stream's messages as one: header and agent stand in the first, poses in all.
  v1::GetTrajectoryResponse all;
  const int64_t pose_count_max = EntriesLeft(session->common().limit);
  const auto merge = [&](const v1::GetTrajectoryResponse& message) {
    all.MergeFrom(message);
    return all.poses_size() < pose_count_max;
  };
  DSG_RETURN_IF_ERROR(
      session->times().Explain(session->api().GetTrajectory(session->NewCall(), request, merge)));
  if (all.poses_size() > pose_count_max) {
    all.mutable_poses()->DeleteSubrange(static_cast<int>(pose_count_max),
                                        all.poses_size() - static_cast<int>(pose_count_max));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderTrack(all, session->times());
  return absl::OkStatus();
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
  DSG_ASSIGN_OR_RETURN(const Interval asked, AskedInterval(session, verb));
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
