// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verb_predict.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/space.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/lookups.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

// Standard deviation of a predicted position on the floor, metres; 0 without a covariance.
double FloorSigmaM(const v1::PredictedPose& pose) {
  // Upper triangle: xx, xy, xz, yy, yz, zz.
  if (pose.covariance_size() != 6) return 0.0;
  return std::sqrt(std::max(0.0, 0.5 * (pose.covariance(0) + pose.covariance(3))));
}

std::string ModelText(v1::PredictionModel model) {
  switch (model) {
    case v1::CONSTANT_VELOCITY:
      return "constant velocity";
    case v1::WEIGHTED_VELOCITY:
      return "weighted velocity";
    default:
      return "goals";
  }
}

std::vector<std::string> WayCells(const v1::PredictedPath& path, int number,
                                  const NodeNames& names) {
  std::vector<std::string> cells{absl::StrCat(number), Fixed(path.probability(), 3),
                                 names.Text(path.goal_node_id())};
  if (path.poses().empty()) return cells;
  const v1::PredictedPose& last = path.poses(path.poses_size() - 1);
  cells.insert(cells.end(), {Fixed(last.position().x(), 2), Fixed(last.position().y(), 2),
                             Fixed(FloorSigmaM(last), 2)});
  return cells;
}

std::string RenderSteps(const v1::PredictedPath& path, const TimeText& times) {
  Table table({{"time", Align::kRight},
               {"x m", Align::kRight},
               {"y m", Align::kRight},
               {"z m", Align::kRight},
               {"sd m", Align::kRight}});
  for (const v1::PredictedPose& pose : path.poses()) {
    table.AddRow({times.Relative(pose.time_ns()), Fixed(pose.position().x(), 2),
                  Fixed(pose.position().y(), 2), Fixed(pose.position().z(), 2),
                  Fixed(FloorSigmaM(pose), 2)});
  }
  return table.Render();
}

}  // namespace

std::string RenderPrediction(const v1::PredictAgentResponse& reply, const TimeText& times,
                             const NodeNames& names) {
  const double speed = std::hypot(reply.velocity().x(), reply.velocity().y());
  Table ways({{"way", Align::kRight},
              {"p", Align::kRight},
              {"towards"},
              {"end x m", Align::kRight},
              {"end y m", Align::kRight},
              {"sd m", Align::kRight}});
  for (int i = 0; i < reply.paths_size(); ++i) {
    ways.AddRow(WayCells(reply.paths(i), i + 1, names));
  }
  std::string text = absl::StrCat(Printable(names.Text(reply.agent_id())), " seen until ",
                                  times.Full(reply.observed_ns()), ", ", Fixed(speed, 2),
                                  " m/s, by ", ModelText(reply.model()), " (revision ",
                                  reply.header().read_revision(), ")\n", ways.Render());
  if (reply.paths().empty()) return text;
  return absl::StrCat(text, "\nway 1\n", RenderSteps(reply.paths(0), times));
}

namespace {

// Less is almost impossible.
constexpr double kChanceMin = 0.01;

}  // namespace

std::string ChanceText(double probability) {
  return probability < kChanceMin ? "<1 %" : absl::StrCat(Fixed(100.0 * probability, 0), " %");
}

namespace {

constexpr uint32_t kPastRgb = 0x555b6b;

v1::PredictionModel ModelOf(const std::string& word) {
  if (word == "cv") return v1::CONSTANT_VELOCITY;
  return word == "weighted" ? v1::WEIGHTED_VELOCITY : v1::GOALS;
}

absl::StatusOr<v1::PredictAgentRequest> PredictionRequest(Session* session,
                                                          const PredictVerb& verb) {
  auto request = session->Begin<v1::PredictAgentRequest>();
  request.set_agent(verb.agent);
  request.set_model(ModelOf(verb.model));
  request.set_path_count_max(verb.path_count);
  request.set_stop_at_walls(verb.stop_at_walls);
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::PredictAgentRequest::set_from_ns));
  DSG_RETURN_IF_ERROR(
      SetDuration("--horizon", verb.horizon, &request, &v1::PredictAgentRequest::set_horizon_ns));
  DSG_RETURN_IF_ERROR(
      SetDuration("--every", verb.every, &request, &v1::PredictAgentRequest::set_period_ns));
  return request;
}

constexpr double kEllipseWidthPx = 2.0;

bool IsUnlikely(const v1::PredictedPath& path) { return path.probability() < kChanceMin; }

// A certain path is eight times as wide as one that is almost impossible.
double WidthOf(const v1::PredictedPath& path) {
  return IsUnlikely(path) ? 2.0 : 3.0 + 13.0 * path.probability();
}

// Where the agent is with the certainty of one standard deviation, seen from above.
void AddEllipse(const v1::PredictedPose& pose, uint32_t rgb, Overlay* overlay) {
  // Upper triangle: xx, xy, xz, yy, yz, zz.
  if (pose.covariance_size() != 6) return;
  const Eigen::Matrix2d covariance{{pose.covariance(0), pose.covariance(1)},
                                   {pose.covariance(1), pose.covariance(3)}};
  const Eigen::Vector3d position = PointOf(pose.position());
  overlay->outlines.push_back({.corners_map = EllipseOf(position.head<2>(), covariance),
                               .rgb = rgb,
                               .height_m = position.z(),
                               .width_px = kEllipseWidthPx,
                               .opacity = 0.08f});
}

// The last observed seconds and the predicted paths: probabilities are widths, and ellipses what is
// known of the position at each step.
absl::StatusOr<AnswerPicture> DrawPrediction(Session* session,
                                             const v1::PredictAgentResponse& reply,
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
  DSG_ASSIGN_OR_RETURN(const auto pieces,
                       WayOf(*session, reply.agent_id(), picture.revision, past));
  if (!pieces.empty()) overlay.legend.push_back({"seen", kPastRgb});
  // The most probable path is drawn last, on top.
  for (int i = reply.paths_size() - 1; i >= 0; --i) {
    const v1::PredictedPath& path = reply.paths(i);
    const uint32_t rgb = AgentColor(static_cast<size_t>(i) + 1);
    OverlayLine line{.points_map = {}, .rgb = rgb, .width_px = WidthOf(path)};
    if (!pieces.empty()) line.points_map.push_back(pieces.back().back());
    for (const v1::PredictedPose& pose : path.poses()) {
      line.points_map.push_back(PointOf(pose.position()));
      // Where nobody is expected, ellipses would only hide the likely paths.
      if (!IsUnlikely(path)) AddEllipse(pose, rgb, &overlay);
    }
    if (line.points_map.empty()) continue;
    overlay.marks.push_back({.position_map = line.points_map.back(),
                             .rgb = rgb,
                             .radius_px = IsUnlikely(path) ? 6.0 : 9.0,
                             .label = ChanceText(path.probability())});
    overlay.lines.push_back(std::move(line));
  }
  for (int i = 0; i < reply.paths_size(); ++i) {
    overlay.legend.push_back(
        {absl::StrCat("way ", i + 1, ": ", ChanceText(reply.paths(i).probability())),
         AgentColor(static_cast<size_t>(i) + 1), WidthOf(reply.paths(i))});
  }
  if (!overlay.outlines.empty()) {
    overlay.legend.push_back({"ellipses: 1 standard deviation", kPastRgb, kEllipseWidthPx});
  }
  for (const auto& piece : pieces) overlay.lines.push_back({piece, kPastRgb});
  if (!pieces.empty()) {
    overlay.marks.push_back(
        {.position_map = pieces.back().back(), .rgb = kPastRgb, .label = agent});
  }
  return picture;
}

absl::Status RunPredict(Session* session, const PredictVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::PredictAgentRequest request, PredictionRequest(session, verb));
  v1::PredictAgentResponse reply;
  DSG_RETURN_IF_ERROR(session->api().PredictAgent(session->NewCall(), request, &reply));
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, DrawPrediction(session, reply, verb.agent));
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

}  // namespace

void AddPredictVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<PredictVerb>({.name = "predict",
                                                      .what = "Where an agent will be",
                                                      .example = "carol --at +84s --horizon 2s",
                                                      .run = RunPredict});
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--at", verb->at,
                  "Predict from this TIME, without later observations; default the end of the "
                  "track");
  app->add_option("--horizon", verb->horizon, "How far to predict; default 4.8s");
  app->add_option("--every", verb->every, "Period of the steps; default 400ms");
  app->add_option("--model", verb->model,
                  "goals: along the places; cv: constant velocity; weighted: weighted mean of the "
                  "last velocities; default goals")
      ->check(CLI::IsMember({"goals", "cv", "weighted"}));
  app->add_option("--paths", verb->path_count, "Maximum number of paths; default 6")
      ->check(Between(1, 20));
  app->add_flag("--stop-at-walls", verb->stop_at_walls, "Cut straight predictions at walls");
  AddPicture(app, "the predicted paths", &verb->picture);
}

}  // namespace dsg::cli
