// SPDX-License-Identifier: Apache-2.0
#include "query/engine/path_question.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/planning/targets.h"
#include "query/engine/request_check.h"
#include "query/engine/search/pattern.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr int kBlockedMax = 10'000;

std::string Describe(const Eigen::Vector3d& point_map) {
  return absl::StrFormat("(%.2f, %.2f, %.2f)", point_map.x(), point_map.y(), point_map.z());
}

class QuestionReader {
 public:
  explicit QuestionReader(const PathContext& context)
      : read_(context.read), view_(&context.view), places_(&context.places), call_(context.call) {}

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
                         FindMatches(*view_, pattern, limits.at_ns, stop));
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

}  // namespace

absl::StatusOr<PathQuestion> ReadPathQuestion(const PathContext& context,
                                              const v1::PlanPathRequest& request) {
  return QuestionReader(context).Read(request);
}

}  // namespace dsg::query
