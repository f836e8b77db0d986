// SPDX-License-Identifier: Apache-2.0
// The verb predict: where an agent will be.
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/export/palette.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/render_space.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kPastRgb = 0x555b6b;

v1::PredictionModel ModelOf(const std::string& word) {
  if (word == "cv") return v1::CONSTANT_VELOCITY;
  return word == "weighted" ? v1::WEIGHTED_VELOCITY : v1::GOALS;
}

absl::StatusOr<v1::PredictAgentRequest> RequestFor(Session* session, const PredictVerb& verb) {
  auto request = session->Begin<v1::PredictAgentRequest>();
  request.set_agent(verb.agent);
  request.set_model(ModelOf(verb.model));
  request.set_path_count_max(verb.path_count);
  request.set_stop_at_walls(verb.stop_at_walls);
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs from_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_from_ns(from_ns);
  }
  if (!verb.horizon.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs horizon_ns, ParseDuration("--horizon", verb.horizon));
    request.set_horizon_ns(horizon_ns);
  }
  if (!verb.every.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs period_ns, ParseDuration("--every", verb.every));
    request.set_period_ns(period_ns);
  }
  return request;
}

// The last seconds that were seen and the ways that are foreseen, the likelier ones thicker.
absl::StatusOr<AnswerPicture> Draw(Session* session, const v1::PredictAgentResponse& reply,
                                   const std::string& agent) {
  constexpr TimeNs kPastNs = 10 * kNsPerSecond;
  AnswerPicture picture{
      .title = absl::StrCat(agent, " after ", session->times().Tenth(reply.observed_ns())),
      .revision = reply.header().read_revision(),
      .at_ns = reply.observed_ns()};
  Overlay& overlay = picture.overlay;
  Interval past;
  if (reply.observed_ns() > kTimeMin + kPastNs) past.from_ns = reply.observed_ns() - kPastNs;
  if (reply.observed_ns() < kTimeMax) past.to_ns = reply.observed_ns() + 1;
  DSG_ASSIGN_OR_RETURN(const auto pieces, WayOf(session, reply.agent_id(), picture.revision, past));
  overlay.legend.push_back({"seen", kPastRgb});
  // From the least likely on, so that the likeliest lies on top.
  for (int i = reply.paths_size() - 1; i >= 0; --i) {
    const v1::PredictedPath& path = reply.paths(i);
    const uint32_t rgb = AgentColor(static_cast<size_t>(i) + 1);
    OverlayLine line{.points_map = {}, .rgb = rgb, .width_px = 4.0 + 8.0 * path.probability()};
    if (!pieces.empty()) line.points_map.push_back(pieces.back().back());
    for (const v1::PredictedPose& pose : path.poses()) {
      line.points_map.push_back(PointOf(pose.position()));
    }
    if (line.points_map.empty()) continue;
    overlay.marks.push_back({.position_map = line.points_map.back(),
                             .rgb = rgb,
                             .radius_px = 9.0,
                             .label = Fixed(path.probability(), 2)});
    overlay.lines.push_back(std::move(line));
  }
  for (int i = 0; i < reply.paths_size(); ++i) {
    overlay.legend.push_back(
        {absl::StrCat("way ", i + 1, ": ", Fixed(reply.paths(i).probability(), 2)),
         AgentColor(static_cast<size_t>(i) + 1)});
  }
  for (const auto& piece : pieces) overlay.lines.push_back({piece, kPastRgb});
  if (!pieces.empty()) {
    overlay.marks.push_back(
        {.position_map = pieces.back().back(), .rgb = kPastRgb, .label = agent});
  }
  return picture;
}

}  // namespace

absl::Status RunPredict(Session* session, const PredictVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::PredictAgentRequest request, RequestFor(session, verb));
  v1::PredictAgentResponse reply;
  DSG_RETURN_IF_ERROR(
      session->times().Explain(session->api().PredictAgent(session->NewCall(), request, &reply)));
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, Draw(session, reply, verb.agent));
  }
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    std::vector<std::string> ids{reply.agent_id()};
    for (const v1::PredictedPath& path : reply.paths()) ids.push_back(path.goal_node_id());
    DSG_ASSIGN_OR_RETURN(const NodeNames names,
                         NamesOf(session, reply.header().read_revision(), ids));
    out << RenderPrediction(reply, session->times(), names);
  }
  return WritePicture(session, verb.picture, picture, out);
}

}  // namespace dsg::cli
