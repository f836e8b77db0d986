// SPDX-License-Identifier: Apache-2.0
// Paths over the places: PlanPath and PlanPaths.
// Refuses ways that are narrower than the robot, and ways nobody has seen to be free.
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
#include "query/engine/planning/attach.h"
#include "query/engine/planning/limits.h"
#include "query/engine/planning/no_path.h"
#include "query/engine/planning/planner.h"
#include "query/engine/planning/targets.h"
#include "query/engine/request.h"
#include "query/engine/search/pattern.h"
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

  //// Answers questions about one revision.
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
      DSG_ASSIGN_OR_RETURN(const PlanResult result,
                           plan(*places_, question.limits, from, to, stop));
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
      const std::string why = Explain(reason, question.limits.radius_m, question.from.text,
                                      question.to.text, &metadata);
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
        for (const PlaceIndex place : route.places)
          polyline.push_back(places_->position_map(place));
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
    static std::optional<Eigen::Vector3d> PositionOf(const PathEndpoint& end,
                                                     const Anchor& anchor) {
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
      for (const auto* link = places_->links_begin(from); link != places_->links_end(from);
           ++link) {
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

absl::Status
PlanPath(Engine* engine, const CallContext& call, const v1::PlanPathRequest& request,
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
