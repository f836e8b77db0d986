// SPDX-License-Identifier: Apache-2.0
// Answers PredictAgent: where an agent will be, from its track and the places that people walk to.
// Uses nothing after the instant that it predicts from.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/space.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/engine/walk_area.h"
#include "query/prediction/goal_prediction.h"
#include "query/prediction/route.h"
#include "query/prediction/velocity.h"
#include "query/view/place_graph.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr TimeNs kHorizonNsDefault = 4'800'000'000;
constexpr TimeNs kPeriodNsDefault = 400'000'000;
constexpr TimeNs kShortestNs = 1'000'000;
constexpr int64_t kStepCountMax = 1000;
// Nothing that was seen a day ago says where somebody is.
constexpr TimeNs kAheadNsMax = 24 * 3600 * kNsPerSecond;
constexpr int kPathCountMax = 20;
constexpr int kPathCountDefault = 6;
// Goals further away hardly tell ways apart.
constexpr double kGoalReachMMin = 25.0;
constexpr double kGoalReachMMax = 40.0;
// Of the velocity that the reply shows.
constexpr double kDecayShown = 0.4;

struct PredictQuestion {
  NodeId agent;
  v1::PredictionModel model = v1::GOALS;
  int path_count_max = kPathCountDefault;
  bool stop_at_walls = false;
  TimeNs from_ns = 0;
  // Of the instants asked for.
  std::vector<TimeNs> at_ns;
};

absl::StatusOr<std::vector<TimeNs>> InstantsAsked(const v1::PredictAgentRequest& request,
                                                  TimeNs from_ns) {
  const TimeNs horizon_ns = request.horizon_ns() == 0 ? kHorizonNsDefault : request.horizon_ns();
  if (horizon_ns < kShortestNs || horizon_ns > kAheadNsMax) {
    return FieldError("horizon_ns", absl::StrCat(horizon_ns),
                      "give 1000000 (1 ms) to a day, or 0 for 4.8 s");
  }
  const TimeNs period_ns =
      request.period_ns() == 0 ? std::min(kPeriodNsDefault, horizon_ns) : request.period_ns();
  if (period_ns < kShortestNs || period_ns > horizon_ns || horizon_ns / period_ns > kStepCountMax) {
    return FieldError("period_ns", absl::StrCat(period_ns),
                      absl::StrCat("give 1000000 (1 ms) to the horizon of ", horizon_ns,
                                   " ns, and at most 1000 steps"));
  }
  std::vector<TimeNs> at_ns;
  for (int64_t step = 1; step <= horizon_ns / period_ns; ++step) {
    // A track may end at the end of time.
    if (from_ns > kTimeMax - step * period_ns) break;
    at_ns.push_back(from_ns + step * period_ns);
  }
  return at_ns;
}

absl::Status OutsideTrack(const TrackInfo& track, TimeNs from_ns, std::string_view what) {
  ErrorMetadata metadata = {{"agent", ToString(track.agent)}, {"from_ns", absl::StrCat(from_ns)}};
  if (track.pose_count > 0) {
    metadata["first_ns"] = absl::StrCat(track.first_ns);
    metadata["last_ns"] = absl::StrCat(track.last_ns);
  }
  return MakeError(Reason::kTimeOutsideTrack,
                   absl::StrCat("agent ", ToString(track.agent), " cannot be predicted from ",
                                from_ns, " ns: ", std::string(what)),
                   std::move(metadata));
}

absl::StatusOr<PredictQuestion> ReadPredictQuestion(const v1::PredictAgentRequest& request,
                                                    const TrackInfo& track) {
  PredictQuestion question;
  question.agent = track.agent;
  if (request.model() != v1::PREDICTION_MODEL_UNSPECIFIED) question.model = request.model();
  if (!v1::PredictionModel_IsValid(request.model())) {
    return FieldError("model", absl::StrCat(static_cast<int>(request.model())),
                      "give GOALS, CONSTANT_VELOCITY or WEIGHTED_VELOCITY");
  }
  if (request.path_count_max() < 0 || request.path_count_max() > kPathCountMax) {
    return FieldError("path_count_max", absl::StrCat(request.path_count_max()),
                      "give 1 to 20, or 0 for 6");
  }
  if (request.path_count_max() > 0) question.path_count_max = request.path_count_max();
  question.stop_at_walls = request.stop_at_walls();
  question.from_ns = request.has_from_ns() ? request.from_ns() : track.last_ns;
  DSG_ASSIGN_OR_RETURN(question.at_ns, InstantsAsked(request, question.from_ns));
  if (track.pose_count == 0) {
    return OutsideTrack(track, question.from_ns, "it has no poses at this revision");
  }
  if (question.from_ns < track.first_ns) {
    return OutsideTrack(
        track, question.from_ns,
        absl::StrCat("its first pose is at ", track.first_ns, " ns; ask from there on"));
  }
  return question;
}

// The last pose at or before an instant.
absl::StatusOr<TimeNs> LastSeen(const Snapshot& snapshot, const TrackInfo& track, TimeNs from_ns) {
  if (from_ns >= track.last_ns) return track.last_ns;
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(track.agent, from_ns));
  return located.before_ns;
}

absl::StatusOr<std::vector<PathPoint>> ReadTrack(const Snapshot& snapshot, const TrackInfo& track,
                                                 TimeNs from_ns, const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const TimeNs last_ns, LastSeen(snapshot, track, from_ns));
  // The far side is out of reach for unsigned differences only.
  if (static_cast<uint64_t>(from_ns) - static_cast<uint64_t>(last_ns) >
      static_cast<uint64_t>(kAheadNsMax)) {
    return OutsideTrack(track, from_ns,
                        absl::StrCat("it was last seen at ", last_ns,
                                     " ns, more than a day "
                                     "before"));
  }
  // Poses beyond the window let its first point lie between two.
  const TimeNs window_ns = kTrackSeenNs + std::clamp(track.gap_ns_max, TimeNs{0}, kTrackSeenNs);
  const TimeNs begin_ns = last_ns < kTimeMin + window_ns ? kTimeMin : last_ns - window_ns;
  std::vector<PathPoint> poses;
  const auto take = [&](const TimedPose& pose) {
    if (pose.time_ns > last_ns) return false;
    poses.push_back({pose.time_ns, pose.map_T_agent.position});
    return true;
  };
  const TimeNs end_ns = last_ns == kTimeMax ? kTimeMax : last_ns + 1;
  DSG_RETURN_IF_ERROR(snapshot.ReadPoses(track.agent, begin_ns, end_ns, stop, take));
  std::vector<PathPoint> points = RecentTrack(poses, track.gap_ns_max);
  if (points.empty()) {
    return OutsideTrack(track, from_ns, "its poses are not there; verify the store");
  }
  return points;
}

// Everything that a model gives.
struct Foreseen {
  v1::PredictionModel model = v1::GOALS;
  std::vector<PredictedPath> paths;
  // Of PredictedPath::goal.
  std::vector<NodeId> goal_nodes;
};

double ReachM(const std::vector<PathPoint>& path, const PredictQuestion& question) {
  const double speed_m_s = SmoothedVelocity(path, kDecayShown).velocity_map.norm();
  return question.at_ns.empty() ? 0.0 : speed_m_s * SecondsAhead(path, question.at_ns.back());
}

// Of the walk areas, so that few differ.
double WantedReachM(const std::vector<PathPoint>& path, const PredictQuestion& question) {
  return 10.0 + 1.5 * ReachM(path, question) > kGoalReachMMin ? kGoalReachMMax : kGoalReachMMin;
}

Foreseen Straight(const std::vector<PathPoint>& path, const PredictQuestion& question,
                  v1::PredictionModel model) {
  PredictedPath path_ahead = model == v1::WEIGHTED_VELOCITY
                                 ? PredictWeightedVelocity(path, question.at_ns, {})
                                 : PredictConstantVelocity(path, question.at_ns, {});
  return {model, {std::move(path_ahead)}, {}};
}

// Of who is far from all places, what weighted velocity says.
absl::StatusOr<Foreseen> ToGoals(const WalkArea& area, const std::vector<PathPoint>& path,
                                 const PredictQuestion& question, const StopCheck& stop) {
  GoalOptions options;
  options.path_count_max = question.path_count_max;
  options.way_m_max = std::max(options.way_m_max, WantedReachM(path, question));
  if (Attach(path.back().position_map, area.field, options).empty()) {
    return Straight(path, question, v1::WEIGHTED_VELOCITY);
  }
  DSG_ASSIGN_OR_RETURN(std::vector<PredictedPath> paths,
                       PredictToGoals(path, question.at_ns, area.field, options, stop));
  return Foreseen{v1::GOALS, std::move(paths), area.goal_nodes};
}

// Straight walks are not bound to an area, however far they lead.
absl::Status StopAtWalls(const PlaceGraph& places, const std::vector<PathPoint>& path,
                         const PredictQuestion& question, const StopCheck& stop,
                         std::vector<PredictedPath>* paths) {
  const WalkTile tile = TileOf(path.back().position_map, kGoalReachMMin + ReachM(path, question));
  DSG_ASSIGN_OR_RETURN(const WalkGraph graph, PlacesOfTile(places, tile, question.from_ns, stop));
  for (PredictedPath& predicted : *paths) {
    DSG_RETURN_IF_ERROR(StopAtEdge(path.back(), graph, stop, &predicted));
  }
  return absl::OkStatus();
}

absl::StatusOr<Foreseen> Foresee(const ReadView& view, WalkAreaCache* areas,
                                 const CallContext& call, const std::vector<PathPoint>& path,
                                 const PredictQuestion& question) {
  const bool is_straight = question.model != v1::GOALS;
  if (is_straight && !question.stop_at_walls) return Straight(path, question, question.model);
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const GraphView> graph, view.Graph(stop));
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const PlaceGraph> places, graph->Places(stop));
  Foreseen foreseen;
  if (is_straight) {
    foreseen = Straight(path, question, question.model);
  } else {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const WalkArea> area,
                         areas->Get(graph, path.back().position_map, WantedReachM(path, question),
                                    question.from_ns, stop));
    DSG_ASSIGN_OR_RETURN(foreseen, ToGoals(*area, path, question, stop));
  }
  if (foreseen.model != v1::GOALS && question.stop_at_walls && places->size() > 0) {
    DSG_RETURN_IF_ERROR(StopAtWalls(*places, path, question, stop, &foreseen.paths));
  }
  return foreseen;
}

void FillPoint(const Eigen::Vector3d& point, v1::Vector3* out) {
  out->set_x(point.x());
  out->set_y(point.y());
  out->set_z(point.z());
}

void FillPaths(const Foreseen& foreseen, const std::vector<TimeNs>& at_ns,
               v1::PredictAgentResponse* reply) {
  for (const PredictedPath& path : foreseen.paths) {
    v1::PredictedPath* out = reply->add_paths();
    out->set_probability(path.probability);
    if (path.goal >= 0) {
      out->set_goal_node_id(ToString(foreseen.goal_nodes[static_cast<size_t>(path.goal)]));
    }
    for (size_t i = 0; i < at_ns.size(); ++i) {
      v1::PredictedPose* pose = out->add_poses();
      pose->set_time_ns(at_ns[i]);
      FillPoint(path.positions_map[i], pose->mutable_position());
      const double square = path.sigma_m[i] * path.sigma_m[i];
      for (const double entry : {square, 0.0, 0.0, square, 0.0, square}) {
        pose->add_covariance(entry);
      }
    }
  }
}

}  // namespace

absl::Status PredictAgent(Engine* engine, const CallContext& call,
                          const v1::PredictAgentRequest& request, v1::PredictAgentResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const Snapshot& snapshot = view.snapshot();
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(snapshot, request.agent()));
  DSG_ASSIGN_OR_RETURN(const TrackInfo track, snapshot.GetTrack(agent));
  DSG_ASSIGN_OR_RETURN(const PredictQuestion question, ReadPredictQuestion(request, track));
  DSG_ASSIGN_OR_RETURN(const std::vector<PathPoint> path,
                       ReadTrack(snapshot, track, question.from_ns, call.stop()));
  DSG_ASSIGN_OR_RETURN(const Foreseen foreseen,
                       Foresee(view, &engine->walk_areas, call, path, question));
  view.FillHeader(reply->mutable_header());
  reply->set_agent_id(ToString(agent));
  reply->set_observed_ns(path.back().time_ns);
  FillPoint(SmoothedVelocity(path, kDecayShown).velocity_map, reply->mutable_velocity());
  reply->set_model(foreseen.model);
  FillPaths(foreseen, question.at_ns, reply);
  return absl::OkStatus();
}

}  // namespace dsg::query
