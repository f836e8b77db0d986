// SPDX-License-Identifier: Apache-2.0
#include "query/cli/agent_pictures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kTrackRgb = 0x1f5fbf;
constexpr uint32_t kAroundRgb = 0x555b6b;

std::string NameOr(const std::string& id, const std::string& name) {
  return name.empty() ? id : name;
}

// A line of a metre in the direction that the agent faces.
OverlayLine Facing(const v1::Pose& pose) {
  constexpr double kLengthM = 1.0;
  const double yaw = YawDeg(pose) * std::numbers::pi / 180.0;
  const Eigen::Vector3d from = PointOf(pose.position());
  const Eigen::Vector3d to = from + kLengthM * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
  return {.points_map = {from, to}, .rgb = kTrackRgb, .width_px = 6.0};
}

// The pose at an end of a gap.
absl::Status MarkEnd(const Session& session, const v1::LocateAgentResponse& reply, TimeNs at_ns,
                     const std::string& label, Overlay* overlay) {
  auto request = session.Begin<v1::LocateAgentRequest>();
  request.mutable_read_at()->set_exact_revision(reply.header().read_revision());
  request.set_agent(reply.agent_id());
  request.set_at_ns(at_ns);
  v1::LocateAgentResponse end;
  DSG_RETURN_IF_ERROR(session.api().LocateAgent(session.NewCall(), request, &end));
  overlay->marks.push_back({.position_map = PointOf(end.pose().position()),
                            .rgb = kTrackRgb,
                            .shape = OverlayMark::Shape::kRing,
                            .label = absl::StrCat(label, " ", session.times().Tenth(at_ns))});
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<AnswerPicture> DrawLocation(const Session& session,
                                           const v1::LocateAgentResponse& reply) {
  constexpr TimeNs kAroundNs = 10 * kNsPerSecond;
  const std::string name = NameOr(reply.agent_id(), reply.agent_name());
  AnswerPicture picture{.title = absl::StrCat(name, " at ", session.times().Tenth(reply.at_ns())),
                        .revision = reply.header().read_revision(),
                        .at_ns = reply.at_ns()};
  Overlay& overlay = picture.overlay;
  Interval around;
  if (reply.at_ns() > kTimeMin + kAroundNs) around.from_ns = reply.at_ns() - kAroundNs;
  if (reply.at_ns() < kTimeMax - kAroundNs) around.to_ns = reply.at_ns() + kAroundNs;
  DSG_ASSIGN_OR_RETURN(const auto pieces,
                       WayOf(session, reply.agent_id(), picture.revision, around));
  for (const auto& piece : pieces) overlay.lines.push_back({piece, kAroundRgb, 4.0});
  if (!pieces.empty()) overlay.legend.push_back({"10 s before and after", kAroundRgb, 4.0});
  if (!reply.has_pose()) {
    picture.title += ", not observed";
    DSG_RETURN_IF_ERROR(MarkEnd(session, reply, reply.before_ns(), "seen until", &overlay));
    DSG_RETURN_IF_ERROR(MarkEnd(session, reply, reply.after_ns(), "again from", &overlay));
    return picture;
  }
  const Eigen::Vector3d position = PointOf(reply.pose().position());
  // Row by row of the upper triangle of 6x6: xx, xy, ..., yy.
  if (reply.covariance_size() == 21) {
    const Eigen::Matrix2d covariance{{reply.covariance(0), reply.covariance(1)},
                                     {reply.covariance(1), reply.covariance(6)}};
    overlay.outlines.push_back({.corners_map = EllipseOf(position.head<2>(), covariance),
                                .rgb = kTrackRgb,
                                .height_m = position.z(),
                                .width_px = 2.0});
    overlay.legend.push_back({"ellipse: 1 standard deviation", kTrackRgb, 2.0});
  }
  if (!reply.orientation_unknown()) {
    overlay.lines.push_back(Facing(reply.pose()));
    overlay.legend.push_back({"faces this way", kTrackRgb, 6.0});
  }
  overlay.marks.push_back({.position_map = position, .rgb = kTrackRgb, .label = name});
  return picture;
}

AnswerPicture DrawTrack(const Session& session, const v1::GetTrajectoryResponse& track,
                        const std::string& agent) {
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

namespace {

// The region or box that was asked for.
absl::Status OutlineAsked(const Session& session, const v1::ListPresenceRequest& request,
                          AnswerPicture* picture) {
  OverlayOutline outline{.corners_map = {}, .rgb = kTrackRgb, .opacity = 0.1f};
  if (request.has_box()) {
    const Eigen::Vector3d low = PointOf(request.box().min());
    const Eigen::Vector3d high = PointOf(request.box().max());
    outline.corners_map = {
        {low.x(), low.y()}, {high.x(), low.y()}, {high.x(), high.y()}, {low.x(), high.y()}};
    outline.height_m = low.z();
  } else {
    auto node_request = session.Begin<v1::GetNodeRequest>();
    node_request.mutable_read_at()->set_exact_revision(picture->revision);
    node_request.set_id(request.node_id());
    v1::GetNodeResponse node;
    DSG_RETURN_IF_ERROR(session.api().GetNode(session.NewCall(), node_request, &node));
    outline.corners_map = OutlineOf(node.node());
    outline.height_m = node.node().map_t_node().position().z();
    absl::StrAppend(&picture->title, " in ", NameOr(node.node().id(), node.node().name()));
  }
  picture->overlay.outlines.push_back(std::move(outline));
  return absl::OkStatus();
}

// The way of one stay, from a ring with its time to a dot.
void AddStay(const std::vector<std::vector<Eigen::Vector3d>>& pieces, uint32_t rgb,
             const std::string& entered, Overlay* overlay) {
  constexpr double kEndRadiusPx = 9.0;
  for (const auto& piece : pieces) overlay->lines.push_back({piece, rgb, 5.0});
  overlay->marks.push_back({.position_map = pieces.front().front(),
                            .rgb = rgb,
                            .shape = OverlayMark::Shape::kRing,
                            .radius_px = kEndRadiusPx,
                            .label = entered});
  overlay->marks.push_back(
      {.position_map = pieces.back().back(), .rgb = rgb, .radius_px = kEndRadiusPx});
}

}  // namespace

absl::StatusOr<AnswerPicture> DrawPresence(const Session& session,
                                           const v1::ListPresenceRequest& request,
                                           const v1::ListPresenceResponse& reply) {
  // More ways would be unreadable; later stays are only listed.
  constexpr int kStayCountMax = 40;
  AnswerPicture picture{.title = Counted(reply.intervals_size(), "stay"),
                        .revision = reply.header().read_revision()};
  DSG_RETURN_IF_ERROR(OutlineAsked(session, request, &picture));
  Overlay& overlay = picture.overlay;
  std::vector<std::string> agents;
  for (int i = 0; i < std::min(reply.intervals_size(), kStayCountMax); ++i) {
    const v1::PresenceInterval& stay = reply.intervals(i);
    const auto found = std::find(agents.begin(), agents.end(), stay.agent_id());
    const uint32_t rgb = AgentColor(static_cast<size_t>(found - agents.begin()));
    if (found == agents.end()) {
      agents.push_back(stay.agent_id());
      overlay.legend.push_back({NameOr(stay.agent_id(), stay.agent_name()), rgb});
    }
    DSG_ASSIGN_OR_RETURN(const auto pieces, WayOf(session, stay.agent_id(), picture.revision,
                                                  {stay.enter_ns(), stay.exit_ns()}));
    if (!pieces.empty()) AddStay(pieces, rgb, session.times().Tenth(stay.enter_ns()), &overlay);
  }
  if (!overlay.marks.empty()) {
    overlay.legend.push_back(
        {.text = "enters", .rgb = kAroundRgb, .shape = OverlayMark::Shape::kRing});
    overlay.legend.push_back(
        {.text = "leaves", .rgb = kAroundRgb, .shape = OverlayMark::Shape::kDot});
  }
  return picture;
}

}  // namespace dsg::cli
