// SPDX-License-Identifier: Apache-2.0
// The verb path: the way from here to there.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/render_space.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kPathRgb = 0x1f5fbf;
constexpr uint32_t kStartRgb = 0x2a8c4a;
constexpr uint32_t kGoalRgb = 0xc8321e;

bool IsColor(absl::string_view word) {
  constexpr std::array<absl::string_view, 12> kColors = {"red",   "orange", "yellow", "green",
                                                         "cyan",  "blue",   "purple", "pink",
                                                         "brown", "black",  "grey",   "white"};
  return std::find(kColors.begin(), kColors.end(), word) != kColors.end();
}

// "couch", "red couch".
void FillPattern(absl::string_view words, v1::NodePattern* pattern) {
  const size_t blank = words.find(' ');
  if (blank != absl::string_view::npos && IsColor(words.substr(0, blank))) {
    pattern->set_color(std::string(words.substr(0, blank)));
    words.remove_prefix(blank + 1);
  }
  pattern->set_class_name(std::string(words));
}

// Names may hold commas, but hardly numbers on either side of them.
bool IsMeantAsPoint(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  const auto is_number = [](const std::string& part) {
    double number = 0.0;
    return part.empty() || absl::SimpleAtod(part, &number);
  };
  return parts.size() > 1 && std::all_of(parts.begin(), parts.end(), is_number);
}

absl::Status FillEnd(const std::string& option, const std::string& text, v1::PathEnd* end) {
  absl::string_view rest = text;
  if (absl::ConsumePrefix(&rest, "nearest ")) {
    FillPattern(rest, end->mutable_nearest());
    return absl::OkStatus();
  }
  if (!IsMeantAsPoint(text)) {
    end->set_node(text);
    return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d point, ParsePoint(option, text));
  end->mutable_position()->set_x(point.x());
  end->mutable_position()->set_y(point.y());
  end->mutable_position()->set_z(point.z());
  return absl::OkStatus();
}

absl::StatusOr<v1::PlanPathRequest> RequestFor(Session* session, const PathVerb& verb) {
  auto request = session->Begin<v1::PlanPathRequest>();
  DSG_RETURN_IF_ERROR(FillEnd("FROM", verb.from, request.mutable_from()));
  DSG_RETURN_IF_ERROR(FillEnd("TO", verb.to, request.mutable_to()));
  request.set_robot_radius_m(verb.radius_m);
  for (const std::string& node : verb.blocked) request.add_blocked(node);
  request.set_mode(verb.flat ? v1::FLAT : v1::HIERARCHICAL);
  if (!verb.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", verb.at, session->map()));
    request.set_at_ns(at_ns);
  }
  request.set_check_collision(verb.check);
  return request;
}

AnswerPicture Draw(const v1::PlanPathRequest& request, const v1::PlanPathResponse& reply,
                   const PathVerb& verb) {
  AnswerPicture picture{.title = absl::StrCat("from ", verb.from, " to ", verb.to, ": ",
                                              Fixed(reply.length_m(), 1), " m"),
                        .revision = reply.header().read_revision()};
  if (request.has_at_ns()) picture.at_ns = request.at_ns();
  OverlayLine line{.points_map = {}, .rgb = kPathRgb};
  for (const v1::Vector3& point : reply.polyline()) line.points_map.push_back(PointOf(point));
  if (!line.points_map.empty()) {
    picture.overlay.marks = {
        {.position_map = line.points_map.front(), .rgb = kStartRgb, .label = "start"},
        {.position_map = line.points_map.back(), .rgb = kGoalRgb, .label = "goal"}};
  }
  picture.overlay.legend.push_back(
      {absl::StrCat("way of ", Fixed(reply.length_m(), 1), " m, clearance at least ",
                    Fixed(reply.clearance_m_min(), 2), " m"),
       kPathRgb});
  if (reply.collision().hit()) {
    picture.overlay.marks.push_back({.position_map = PointOf(reply.collision().point()),
                                     .rgb = 0xd0104c,
                                     .shape = OverlayMark::Shape::kCross,
                                     .label = "touches"});
  }
  picture.overlay.lines.push_back(std::move(line));
  return picture;
}

}  // namespace

absl::Status RunPath(Session* session, const PathVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::PlanPathRequest request, RequestFor(session, verb));
  v1::PlanPathResponse reply;
  DSG_RETURN_IF_ERROR(
      session->times().Explain(session->api().PlanPath(session->NewCall(), request, &reply)));
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(reply, out));
  } else {
    std::vector<std::string> ids(reply.room_ids().begin(), reply.room_ids().end());
    ids.insert(ids.end(), {reply.from_node_id(), reply.to_node_id(), reply.collision().node_id()});
    DSG_ASSIGN_OR_RETURN(const NodeNames names,
                         NamesOf(session, reply.header().read_revision(), ids));
    out << RenderPath(reply, names);
  }
  return WritePicture(session, verb.picture, Draw(request, reply, verb), out);
}

}  // namespace dsg::cli
