// SPDX-License-Identifier: Apache-2.0
// Answers PlanPath and PlanPaths: paths over the places. Refuses ways that are narrower than the
// robot, and ways that nobody has seen to be free.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "dsg/v1/query_service.pb.h"
#include "query/api/call_context.h"
#include "query/engine/collision/collision_world.h"
#include "query/engine/engine.h"
#include "query/engine/planning/ends.h"
#include "query/engine/planning/no_path.h"
#include "query/engine/planning/planner.h"
#include "query/engine/request.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/query_language.h"
#include "query/engine/search/search_run.h"
#include "query/view/place_graph.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr int kPathsMax = 1000;
constexpr int kBlockedMax = 10'000;
// A swept point would touch nothing; a robot is never that small.
constexpr double kSweptRadiusMinM = 0.05;

struct PathEndpoint {
  std::vector<PathTarget> targets;
  /// As errors name it.
  std::string text;
};

struct PathQuestion {
  Limits limits;
  PathEndpoint from;
  PathEndpoint to;
  bool flat = false;
};

std::string Describe(const Eigen::Vector3d& point_map) {
  return absl::StrFormat("(%.2f, %.2f, %.2f)", point_map.x(), point_map.y(), point_map.z());
}

class PathQuestionReader {
 public:
  /// One revision, as a call sees it. All outlive this.
  PathQuestionReader(const ReadView& read, const GraphView& view, const PlaceGraph& places,
                     const CallContext& call)
      : read_(read), view_(&view), places_(&places), call_(call) {}

  /// Errors: FIELD_INVALID, NUMBER_NOT_FINITE, NODE_UNKNOWN naming the field; those of patterns;
  /// TIME_OUTSIDE_TRACK for agents; NO_PATH when an end is nowhere at that time; the call's end.
  absl::StatusOr<PathQuestion> Read(const v1::PlanPathRequest& request) const {
    PathQuestion question;
    const double radius_m = request.robot_radius_m();
    if (!std::isfinite(radius_m) || radius_m < 0.0) {
      return FieldError("robot_radius_m", absl::StrCat(radius_m),
                        "give finite metres, 0 for a point");
    }
    if (!v1::PlanMode_IsValid(request.mode())) {
      return FieldError("mode", absl::StrCat(static_cast<int>(request.mode())),
                        "give HIERARCHICAL or FLAT");
    }
    question.flat = request.mode() == v1::FLAT;
    question.limits.radius_m = radius_m;
    if (request.has_at_ns()) question.limits.at_ns = request.at_ns();
    const StopCheck stop = call_.stop();
    const PathWorld world{
        *view_, read_.snapshot(), *places_,
        request.has_at_ns() ? std::optional<TimeNs>(request.at_ns()) : std::nullopt, stop};
    DSG_RETURN_IF_ERROR(ReadBlocked(world, request, &question.limits));
    DSG_ASSIGN_OR_RETURN(question.from, ReadEnd(world, question.limits, request.from(), "from"));
    DSG_ASSIGN_OR_RETURN(question.to, ReadEnd(world, question.limits, request.to(), "to"));
    return question;
  }

 private:
  absl::Status ReadBlocked(const PathWorld& world, const v1::PlanPathRequest& request,
                           Limits* limits) const {
    if (request.blocked_size() > kBlockedMax) {
      return FieldError("blocked", absl::StrCat(request.blocked_size(), " nodes"),
                        "give at most 10000; name rooms rather than their places");
    }
    for (int i = 0; i < request.blocked_size(); ++i) {
      const std::string field = absl::StrCat("blocked[", i, "]");
      DSG_ASSIGN_OR_RETURN(const ViewNode* node, FindNode(request.blocked(i), field));
      DSG_ASSIGN_OR_RETURN(const bool is_blocked, Block(world, *node, &limits->blocked));
      if (!is_blocked) {
        return FieldError(field, request.blocked(i),
                          "it is no place and has none below it; give places, rooms or nodes of "
                          "layers above");
      }
      DSG_RETURN_IF_ERROR(call_.Check());
    }
    return absl::OkStatus();
  }

  // By id or, failing that, by a name that only one node has.
  absl::StatusOr<const ViewNode*> FindNode(const std::string& text, std::string_view field) const {
    if (text.empty()) return FieldError(field, "", "give the id or the name of a node");
    if (const absl::StatusOr<NodeId> id = ParseNodeId(text); id.ok()) {
      if (const ViewNode* node = view_->FindNode(*id); node != nullptr) return node;
    }
    const std::vector<NodeId> named = view_->NodesNamed(text);
    if (named.size() > 1) {
      return FieldError(
          field, text,
          absl::StrCat(named.size(), " nodes have this name, the first are ", ToString(named[0]),
                       " and ", ToString(named[1]), "; give an id"));
    }
    if (named.empty()) {
      const std::string& map = read_.snapshot().spec().name;
      return MakeError(
          Reason::kNodeUnknown,
          absl::StrCat(std::string(field), ": no node of map \"", map, "\" has the id or name \"",
                       text, "\" at revision ", read_.snapshot().revision()),
          {{"map", map}, {"node", text}, {"field", std::string(field)}});
    }
    return view_->FindNode(named.front());
  }

  absl::StatusOr<PathEndpoint> ReadEnd(const PathWorld& world, const Limits& limits,
                                       const v1::PathEnd& in, const std::string& field) const {
    PathEndpoint end;
    switch (in.end_case()) {
      case v1::PathEnd::kPosition: {
        PathTarget& target = end.targets.emplace_back();
        DSG_ASSIGN_OR_RETURN(target.position_map,
                             PointFromProto(in.position(), absl::StrCat(field, ".position")));
        end.text = Describe(*target.position_map);
        return end;
      }
      case v1::PathEnd::kNode: {
        DSG_ASSIGN_OR_RETURN(const ViewNode* node,
                             FindNode(in.node(), absl::StrCat(field, ".node")));
        end.text = ToString(node->id);
        // Of agents the track says when they were there.
        if (!limits.Holds(node->valid) && !IsAgent(*view_, *node)) {
          return Nowhere(field, end.text, "it is not in the world at that time");
        }
        DSG_ASSIGN_OR_RETURN(PathTarget target, TargetOf(world, *node));
        end.targets.push_back(std::move(target));
        return end;
      }
      case v1::PathEnd::kNearest:
        return ReadNearest(world, limits, in.nearest(), field);
      case v1::PathEnd::END_NOT_SET:
        break;
    }
    return FieldError(field, "", "give a position, a node, or what the nearest is wanted of");
  }

  absl::StatusOr<PathEndpoint> ReadNearest(const PathWorld& world, const Limits& limits,
                                           const v1::NodePattern& in,
                                           const std::string& field) const {
    if (in.ByteSizeLong() == 0) {
      return FieldError(absl::StrCat(field, ".nearest"), "",
                        "say what the nearest is wanted of, at least a kind or a class");
    }
    const StopCheck stop = call_.stop();
    DSG_ASSIGN_OR_RETURN(const Pattern pattern,
                         PatternFromProto(in, *view_, &read_.snapshot(), stop));
    DSG_ASSIGN_OR_RETURN(const std::vector<NodeId> found,
                         FindMatches(*view_, pattern, &read_.snapshot(), limits.at_ns, stop));
    PathEndpoint end;
    end.text = absl::StrCat("nearest ", FormatQuery(pattern.source()));
    for (size_t i = 0; i < found.size(); ++i) {
      // There may be many places below each.
      if (i % 16 == 0) DSG_RETURN_IF_ERROR(call_.Check());
      absl::StatusOr<PathTarget> target = TargetOf(world, *view_->FindNode(found[i]));
      // Agents that were not seen at that time are not the nearest.
      if (ReasonOf(target.status()) == Reason::kTimeOutsideTrack) continue;
      if (!target.ok()) return target.status();
      end.targets.push_back(*std::move(target));
    }
    if (end.targets.empty()) return Nowhere(field, end.text, "nothing matches at that time");
    return end;
  }

  // An end that is nowhere.
  static absl::Status Nowhere(const std::string& field, const std::string& text,
                              const std::string& why) {
    return MakeError(Reason::kNoPath, absl::StrCat("no path: ", field, " is ", text, ", and ", why),
                     {{field, text}, {"why", why}});
  }

  const ReadView& read_;
  const GraphView* view_;
  const PlaceGraph* places_;
  const CallContext& call_;
};

/// Answers questions about one revision.
class PathAnswerer {
 public:
  PathAnswerer(const ReadView& read, std::shared_ptr<const GraphView> view,
               std::shared_ptr<const PlaceGraph> places, CollisionCache* collisions,
               const CallContext& call)
      : read_(read),
        view_(std::move(view)),
        places_(std::move(places)),
        collisions_(collisions),
        call_(call) {}

  absl::Status Answer(const v1::PlanPathRequest& request, v1::PlanPathResponse* reply) {
    DSG_ASSIGN_OR_RETURN(const PathQuestion question,
                         PathQuestionReader(read_, *view_, *places_, call_).Read(request));
    const StopCheck stop = call_.stop();
    const LineCheck is_free = FreeLine(request, question.limits.radius_m);
    DSG_ASSIGN_OR_RETURN(const std::vector<Anchor> from,
                         Attach(*places_, question.limits, question.from.targets, is_free, stop));
    DSG_ASSIGN_OR_RETURN(const std::vector<Anchor> to,
                         Attach(*places_, question.limits, question.to.targets, is_free, stop));
    const auto plan = question.flat ? PlanFlat : PlanHierarchical;
    DSG_ASSIGN_OR_RETURN(const PlanResult result, plan(*places_, question.limits, from, to, stop));
    if (!result.route.has_value()) return NoPathError(question, is_free);
    reply->set_expanded_count(result.expanded_count);
    reply->set_mode(question.flat ? v1::FLAT : v1::HIERARCHICAL);
    const std::vector<Eigen::Vector3d> polyline = Fill(question, *result.route, reply);
    if (!request.check_collision()) return absl::OkStatus();
    return Sweep(request, question, *result.route, polyline, reply->mutable_collision());
  }

 private:
  absl::Status NoPathError(const PathQuestion& question, const LineCheck& is_free) const {
    DSG_ASSIGN_OR_RETURN(const NoPath reason,
                         ExplainNoPath(*places_, question.limits, question.from.targets,
                                       question.to.targets, is_free, call_.stop()));
    ErrorMetadata metadata = {{"from", question.from.text}, {"to", question.to.text}};
    const std::string why =
        Explain(reason, question.limits.radius_m, question.from.text, question.to.text, &metadata);
    metadata["why"] = why;
    return MakeError(
        Reason::kNoPath,
        absl::StrCat("no path from ", question.from.text, " to ", question.to.text, ": ", why),
        std::move(metadata));
  }

  std::vector<Eigen::Vector3d> Fill(const PathQuestion& question, const PlaceRoute& route,
                                    v1::PlanPathResponse* reply) const {
    const auto from = PositionOf(question.from, route.from);
    const auto to = PositionOf(question.to, route.to);
    std::vector<Eigen::Vector3d> polyline;
    if (from.has_value()) polyline.push_back(*from);
    if (!from.has_value() || !to.has_value() || !IsStraight(question, route)) {
      for (const PlaceIndex place : route.places) polyline.push_back(places_->position_map(place));
    }
    if (to.has_value()) polyline.push_back(*to);

    FillPlaces(question.limits, route, reply);
    double length_m = 0.0;
    for (size_t i = 0; i < polyline.size(); ++i) {
      v1::Vector3* point = reply->add_polyline();
      point->set_x(polyline[i].x());
      point->set_y(polyline[i].y());
      point->set_z(polyline[i].z());
      if (i > 0) length_m += (polyline[i] - polyline[i - 1]).norm();
    }
    reply->set_length_m(length_m);
    reply->set_from_node_id(ToString(route.from.node));
    reply->set_to_node_id(ToString(route.to.node));
    return polyline;
  }

  // Where the polyline begins or ends beyond the places; nullopt if it does not.
  static std::optional<Eigen::Vector3d> PositionOf(const PathEndpoint& end, const Anchor& anchor) {
    if (anchor.is_apart) return std::nullopt;
    return std::find_if(end.targets.begin(), end.targets.end(),
                        [&](const PathTarget& target) { return target.node == anchor.node; })
        ->position_map;
  }

  // Both ends within the free space of one place: no need to go through its middle.
  bool IsStraight(const PathQuestion& question, const PlaceRoute& route) const {
    if (route.places.size() != 1) return false;
    return std::max(route.from.way_m, route.to.way_m) + question.limits.radius_m <=
           places_->clearance_m(route.places.front());
  }

  void FillPlaces(const Limits& limits, const PlaceRoute& route,
                  v1::PlanPathResponse* reply) const {
    double clearance_m = places_->clearance_m(route.places.front());
    NodeId room;
    for (size_t i = 0; i < route.places.size(); ++i) {
      const PlaceIndex place = route.places[i];
      reply->add_place_ids(ToString(places_->id(place)));
      const NodeId here = places_->room(place);
      if (!here.empty() && here != room) reply->add_room_ids(ToString(here));
      if (!here.empty()) room = here;
      if (i > 0) clearance_m = std::min(clearance_m, Widest(limits, route.places[i - 1], place));
    }
    reply->set_clearance_m_min(clearance_m);
  }

  // Of the links between two neighbours; its clearance is at most that of both.
  double Widest(const Limits& limits, PlaceIndex from, PlaceIndex to) const {
    double widest_m = 0.0;
    for (const auto* link = places_->links_begin(from); link != places_->links_end(from); ++link) {
      if (link->to != to || !limits.Admits(*link)) continue;
      widest_m = std::max(widest_m, static_cast<double>(link->clearance_m));
    }
    return widest_m;
  }

  CollisionWorld Obstacles(const v1::PlanPathRequest& request) const {
    return CollisionWorld::Create(
        view_, read_.shared_snapshot(),
        request.has_at_ns() ? std::optional<TimeNs>(request.at_ns()) : std::nullopt, collisions_);
  }

  // Where no clearance says that a way is free: does the map know of anything in it?
  LineCheck FreeLine(const v1::PlanPathRequest& request, double radius_m) const {
    return [this, &request, radius_m](const Eigen::Vector3d& from_map,
                                      const Eigen::Vector3d& to_map) -> absl::StatusOr<bool> {
      CollisionWorld world = Obstacles(request);
      CollisionScope scope;
      // Those who move are not there for long, and one of them may be who asks.
      scope.agents = false;
      scope.ignore_floor = true;
      const Body body = SweptSphere(std::max(radius_m, kSweptRadiusMinM), {from_map, to_map});
      DSG_ASSIGN_OR_RETURN(const CollisionHit hit, world.Check(body, scope, call_.stop()));
      return !hit.hit;
    };
  }

  absl::Status Sweep(const v1::PlanPathRequest& request, const PathQuestion& question,
                     const PlaceRoute& route, const std::vector<Eigen::Vector3d>& polyline,
                     v1::CollisionResult* result) const {
    CollisionWorld world = Obstacles(request);
    CollisionScope scope;
    // Places of flat maps lie on the floor.
    scope.ignore_floor = true;
    // Nobody runs into himself, or into the one he goes to.
    for (const NodeId node : {route.from.node, route.to.node}) {
      if (node.empty()) continue;
      const ViewNode* known = view_->FindNode(node);
      if (known == nullptr || !IsAgent(*view_, *known)) continue;
      DSG_RETURN_IF_ERROR(world.Ignore(node, call_.stop(), &scope));
    }
    const Body body = SweptSphere(std::max(question.limits.radius_m, kSweptRadiusMinM), polyline);
    DSG_ASSIGN_OR_RETURN(const CollisionHit hit, world.Check(body, scope, call_.stop()));
    result->set_hit(hit.hit);
    result->set_clearance_m(hit.clearance_m);
    result->set_node_id(ToString(hit.node));
    result->set_what(ToString(hit.kind));
    if (hit.kind != ObstacleKind::kNone) {
      result->mutable_point()->set_x(hit.point_map.x());
      result->mutable_point()->set_y(hit.point_map.y());
      result->mutable_point()->set_z(hit.point_map.z());
    }
    result->set_at_pose(hit.at_pose);
    result->set_observed(hit.observed);
    return absl::OkStatus();
  }

  const ReadView& read_;
  std::shared_ptr<const GraphView> view_;
  std::shared_ptr<const PlaceGraph> places_;
  CollisionCache* collisions_;
  const CallContext& call_;
};

absl::StatusOr<PathAnswerer> MakeAnswerer(const ReadView& view, CollisionCache* collisions,
                                          const CallContext& call) {
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const GraphView> graph, view.Graph(stop));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const PlaceGraph> places, graph->Places(stop));
  return PathAnswerer(view, std::move(graph), std::move(places), collisions, call);
}

}  // namespace

absl::Status PlanPath(Engine* engine, const CallContext& call, const v1::PlanPathRequest& request,
                      v1::PlanPathResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(PathAnswerer answerer, MakeAnswerer(view, &engine->collisions, call));
  DSG_RETURN_IF_ERROR(answerer.Answer(request, reply));
  view.FillHeader(reply->mutable_header());
  return absl::OkStatus();
}

absl::Status PlanPaths(Engine* engine, const CallContext& call, const v1::PlanPathsRequest& request,
                       v1::PlanPathsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  if (request.paths_size() > kPathsMax) {
    return FieldError("paths", absl::StrCat(request.paths_size(), " paths"),
                      "ask for at most 1000 a call");
  }
  DSG_ASSIGN_OR_RETURN(PathAnswerer answerer, MakeAnswerer(view, &engine->collisions, call));
  view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  for (const v1::PlanPathRequest& path : request.paths()) {
    DSG_RETURN_IF_ERROR(call.Check());
    v1::PlanPathResult* result = reply->add_results();
    const absl::Status status = answerer.Answer(path, result->mutable_path());
    if (!status.ok()) {
      DSG_RETURN_IF_ERROR(call.Check());
      result->clear_path();
      result->set_status_code(static_cast<int32_t>(status.code()));
      result->set_status_message(std::string(status.message()));
    }
    bytes += result->ByteSizeLong();
    if (bytes > kReplyBytesMax) {
      return FieldError("paths", absl::StrCat(request.paths_size(), " paths"),
                        absl::StrCat("the first ", reply->results_size(),
                                     " alone fill a reply; ask for fewer a call"));
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
