// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_agents.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/table.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {
namespace {

std::string AgentText(const std::string& id, const std::string& name) {
  return name.empty() || name == id ? id : absl::StrCat(name, " (", id, ")");
}

std::string PoseText(const v1::LocateAgentResponse& reply, const TimeText& times) {
  if (reply.quality() == v1::IN_GAP) {
    return absl::StrCat("not observed: the track has a gap from ",
                        times.Relative(reply.before_ns()), " to ",
                        times.Relative(reply.after_ns()));
  }
  const v1::Vector3& p = reply.pose().position();
  std::string text =
      absl::StrCat("x ", Fixed(p.x(), 2), " y ", Fixed(p.y(), 2), " z ", Fixed(p.z(), 2), " m");
  if (!reply.orientation_unknown()) {
    absl::StrAppend(&text, ", yaw ", Fixed(YawDeg(reply.pose()), 1), " deg");
  }
  if (reply.quality() == v1::EXACT) return text + ", measured";
  return absl::StrCat(text, ", interpolated between ", times.Relative(reply.before_ns()), " and ",
                      times.Relative(reply.after_ns()));
}

std::string WhereaboutsText(const v1::LocateAgentResponse& reply, const std::string& room_name) {
  std::vector<std::string> parts;
  if (!reply.place_id().empty()) parts.push_back("place " + reply.place_id());
  if (!reply.room_id().empty()) {
    parts.push_back(absl::StrCat("room ", reply.room_id(),
                                 room_name.empty() ? "" : absl::StrCat(" \"", room_name, "\"")));
  }
  if (!reply.building_id().empty()) parts.push_back("building " + reply.building_id());
  return parts.empty() ? "in no known place" : absl::StrJoin(parts, ", ");
}

std::string FlagsText(uint32_t flags) {
  std::vector<std::string> words;
  if (flags & pose_flags::kCorrected) words.push_back("corrected");
  if (flags & pose_flags::kPredicted) words.push_back("predicted");
  return absl::StrJoin(words, ",");
}

// A column that a map without dates does not need.
void AddDateColumn(const TimeText& times, std::vector<Column>* columns) {
  if (times.has_dates()) columns->push_back({"date"});
}

}  // namespace

double YawDeg(const v1::Pose& pose) {
  const v1::Quaternion& q = pose.orientation();
  // A message without an orientation means the identity; its zeros give 0 here as well.
  const double sine = 2.0 * (q.w() * q.z() + q.x() * q.y());
  const double cosine = 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z());
  return std::atan2(sine, cosine) * 180.0 / std::numbers::pi;
}

std::string RenderLocation(const v1::LocateAgentResponse& reply, const TimeText& times,
                           const std::string& room_name) {
  return Printable(absl::StrCat(AgentText(reply.agent_id(), reply.agent_name()), " at ",
                                times.Full(reply.at_ns()), " (revision ",
                                reply.header().read_revision(), "): ", PoseText(reply, times), "; ",
                                WhereaboutsText(reply, room_name))) +
         "\n";
}

std::string RenderTrack(const v1::GetTrajectoryResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"time", Align::kRight},    {"x m", Align::kRight},
                              {"y m", Align::kRight},     {"z m", Align::kRight},
                              {"yaw deg", Align::kRight}, {"note"}};
  AddDateColumn(times, &columns);
  Table table(columns);
  for (const v1::TimedPose& pose : reply.poses()) {
    const v1::Vector3& p = pose.pose().position();
    const bool has_yaw = (pose.flags() & pose_flags::kNoOrientation) == 0;
    std::vector<std::string> cells{times.Relative(pose.time_ns()),
                                   Fixed(p.x(), 3),
                                   Fixed(p.y(), 3),
                                   Fixed(p.z(), 3),
                                   has_yaw ? Fixed(YawDeg(pose.pose()), 1) : "-",
                                   FlagsText(pose.flags())};
    if (times.has_dates()) cells.push_back(times.Date(pose.time_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.poses_size(), "pose"), " of ", reply.agent_id(),
                      " (revision ", reply.header().read_revision(), ")\n");
}

std::string RenderPresence(const v1::ListPresenceResponse& reply, const TimeText& times) {
  std::vector<Column> columns{{"agent"},
                              {"name"},
                              {"enter", Align::kRight},
                              {"exit", Align::kRight},
                              {"stayed", Align::kRight},
                              {"in"}};
  AddDateColumn(times, &columns);
  Table table(columns);
  for (const v1::PresenceInterval& stay : reply.intervals()) {
    std::vector<std::string> cells{stay.agent_id(),
                                   stay.agent_name(),
                                   times.Relative(stay.enter_ns()),
                                   times.Relative(stay.exit_ns()),
                                   DurationText(stay.enter_ns(), stay.exit_ns()),
                                   stay.node_id()};
    if (times.has_dates()) cells.push_back(times.Date(stay.enter_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.intervals_size(), "stay"), "; ",
                      Counted(reply.observed_agent_count(), "agent"),
                      " observed anywhere in that time (revision ", reply.header().read_revision(),
                      ")", reply.next_page_token().empty() ? "" : "; there are more, see --limit",
                      "\n");
}

}  // namespace dsg::cli
