// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_space.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/space.pb.h"
#include "query/cli/node_cells.h"
#include "query/cli/table.h"

namespace dsg::cli {
namespace {

using Ids = google::protobuf::RepeatedPtrField<std::string>;

std::string NamedInOrder(const Ids& ids, const NodeNames& names) {
  return absl::StrJoin(
      ids, " > ", [&](std::string* out, const std::string& id) { out->append(names.Text(id)); });
}

// The ends of a long list; all of it is in the JSON.
std::string ShortList(const Ids& ids) {
  constexpr int kAll = 12;
  constexpr int kEnd = 5;
  if (ids.size() <= kAll) return absl::StrJoin(ids, " ");
  return absl::StrCat(absl::StrJoin(ids.begin(), ids.begin() + kEnd, " "), " ... ",
                      absl::StrJoin(ids.end() - kEnd, ids.end(), " "));
}

std::string EndText(const v1::PlanPathResponse& reply, bool at_end, const NodeNames& names) {
  std::string text = names.Text(at_end ? reply.to_node_id() : reply.from_node_id());
  if (reply.polyline().empty()) return text;
  const v1::Vector3& position = reply.polyline(at_end ? reply.polyline_size() - 1 : 0);
  return absl::StrCat(text, text.empty() ? "" : ", ", PositionText(position));
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

std::string RenderPath(const v1::PlanPathResponse& reply, const NodeNames& names) {
  return RenderFields(
      {{"from", EndText(reply, false, names)},
       {"to", EndText(reply, true, names)},
       {"length", Fixed(reply.length_m(), 2) + " m"},
       {"clearance", absl::StrCat("at least ", Fixed(reply.clearance_m_min(), 2), " m")},
       {"rooms", NamedInOrder(reply.room_ids(), names)},
       {"places", absl::StrCat(reply.place_ids_size(), ": ", ShortList(reply.place_ids()))},
       {"touches", reply.has_collision() ? CollisionText(reply.collision(), names) : ""},
       {"found", absl::StrCat(reply.mode() == v1::FLAT ? "over all places" : "rooms first", ", ",
                              Counted(reply.expanded_count(), "place"), " looked at (revision ",
                              reply.header().read_revision(), ")")}});
}

std::string CollisionText(const v1::CollisionResult& result, const NodeNames& names) {
  std::string thing = result.what();
  for (char& c : thing) c = c == '_' ? ' ' : c;
  if (!result.node_id().empty()) absl::StrAppend(&thing, " ", names.Text(result.node_id()));
  const char* unobserved =
      result.observed() ? "" : "; part of the body is outside of what the map knows";
  if (result.hit()) {
    return absl::StrCat("hit ", thing, " at ", PositionText(result.point()), unobserved);
  }
  if (result.what().empty()) {
    return absl::StrCat("free, nothing within ", Fixed(result.clearance_m(), 2), " m", unobserved);
  }
  return absl::StrCat("free, ", Fixed(result.clearance_m(), 2), " m from ", thing, " at ",
                      PositionText(result.point()), unobserved);
}

std::string RenderCollisions(const v1::CheckCollisionResponse& reply, const NodeNames& names) {
  std::string text;
  for (const v1::CollisionResult& result : reply.results()) {
    absl::StrAppend(&text, Printable(CollisionText(result, names)));
    // Of one pose there is no way to be on.
    if (result.at_pose() > 0.0) {
      absl::StrAppend(&text, ", on the way at pose ", Fixed(result.at_pose(), 3));
    }
    absl::StrAppend(&text, " (revision ", reply.header().read_revision(), ")\n");
  }
  return text;
}

double FloorSigmaM(const v1::PredictedPose& pose) {
  // Upper triangle: xx, xy, xz, yy, yz, zz.
  if (pose.covariance_size() != 6) return 0.0;
  return std::sqrt(std::max(0.0, 0.5 * (pose.covariance(0) + pose.covariance(3))));
}

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

}  // namespace dsg::cli
