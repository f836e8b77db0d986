// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/no_path.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "query/engine/planning/search_scratch.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

std::string RoomText(NodeId room) { return room.empty() ? "no room" : ToString(room); }

}  // namespace

absl::StatusOr<std::optional<double>> WidestRadius(const PlaceGraph& graph, const Limits& limits,
                                                   const std::vector<Anchor>& from,
                                                   const std::vector<Anchor>& to,
                                                   const StopCheck& stop) {
  Limits any_width = limits;
  any_width.radius_m = 0.0;
  const BorrowedScratch scratch;
  scratch->Begin(graph.size());
  for (const Anchor& goal : to) scratch->at(goal.place).goal = 0;
  // The queue gives the smallest first, so widths go in negative; way_m holds them likewise.
  const auto reach = [&](PlaceIndex place, double width_m) {
    SearchScratch::Cell& cell = scratch->at(place);
    if (cell.settled || (cell.reached && -cell.way_m >= width_m)) return;
    if (!any_width.Admits(graph, place)) return;
    cell.reached = true;
    cell.way_m = -width_m;
    scratch->Push(-width_m, place, false);
  };
  for (const Anchor& anchor : from) reach(anchor.place, graph.clearance_m(anchor.place));
  for (int64_t count = 0; !scratch->empty(); ++count) {
    if (count % kPlacesPerStop == 0 && stop) DSG_RETURN_IF_ERROR(stop());
    const SearchScratch::Entry entry = scratch->Pop();
    SearchScratch::Cell& cell = scratch->at(entry.place());
    if (cell.settled) continue;
    cell.settled = true;
    const double width_m = -entry.total_m;
    if (cell.goal >= 0) return std::optional<double>(width_m);
    for (const auto* link = graph.links_begin(entry.place());
         link != graph.links_end(entry.place()); ++link) {
      if (!any_width.Admits(*link)) continue;
      // Links are kept with fewer digits than places.
      reach(link->to, std::min({width_m, static_cast<double>(link->clearance_m),
                                graph.clearance_m(link->to)}));
    }
  }
  return std::optional<double>();
}

absl::StatusOr<NoPath> ExplainNoPath(const PlaceGraph& graph, const Limits& limits,
                                     const std::vector<PathTarget>& from,
                                     const std::vector<PathTarget>& to, const LineCheck& is_free,
                                     const StopCheck& stop) {
  struct Relaxation {
    bool width;
    bool blocks;
    bool time;
    NoPathCause cause;
  };
  // Cheapest wish first.
  static constexpr Relaxation kRelaxations[] = {
      {false, true, false, NoPathCause::kBlocked},
      {true, false, false, NoPathCause::kTooNarrow},
      {true, true, false, NoPathCause::kTooNarrowAndBlocked},
      {true, true, true, NoPathCause::kNotAtThatTime},
  };
  NoPath reason;
  for (const Relaxation& relax : kRelaxations) {
    Limits loose = limits;
    if (relax.width) loose.radius_m = 0.0;
    if (relax.blocks) loose.blocked.clear();
    loose.any_time = relax.time;
    DSG_ASSIGN_OR_RETURN(const std::vector<Anchor> starts,
                         Attach(graph, loose, from, is_free, stop));
    DSG_ASSIGN_OR_RETURN(const std::vector<Anchor> goals, Attach(graph, loose, to, is_free, stop));
    if (!starts.empty()) reason.from_room = graph.room(starts.front().place);
    if (!goals.empty()) reason.to_room = graph.room(goals.front().place);
    if (relax.time && starts.empty()) reason.cause = NoPathCause::kNoPlaceAtStart;
    if (relax.time && !starts.empty() && goals.empty()) reason.cause = NoPathCause::kNoPlaceAtEnd;
    if (starts.empty() || goals.empty()) continue;
    DSG_ASSIGN_OR_RETURN(const std::optional<double> radius_m,
                         WidestRadius(graph, loose, starts, goals, stop));
    if (!radius_m.has_value()) continue;
    if (!relax.width && *radius_m < limits.radius_m) continue;
    reason.cause = relax.cause;
    reason.radius_m_max = *radius_m;
    return reason;
  }
  return reason;
}

std::string Explain(const NoPath& reason, double radius_m, const std::string& from,
                    const std::string& to, ErrorMetadata* metadata) {
  if (!reason.from_room.empty()) (*metadata)["from_room"] = ToString(reason.from_room);
  if (!reason.to_room.empty()) (*metadata)["to_room"] = ToString(reason.to_room);
  // Rounded down, so that the radius can be taken from the answer.
  const std::string radius =
      absl::StrFormat("%.3f", std::floor(reason.radius_m_max * 1000.0) / 1000.0);
  switch (reason.cause) {
    case NoPathCause::kNoPlaceAtStart:
      return absl::StrCat("no place is near the start ", from);
    case NoPathCause::kNoPlaceAtEnd:
      return absl::StrCat("no place is near the end ", to);
    case NoPathCause::kTooNarrow:
      (*metadata)["radius_m_max"] = radius;
      return absl::StrCat("a robot of ", radius_m, " m radius is too wide; the widest way admits ",
                          radius, " m");
    case NoPathCause::kBlocked:
      return "blocked nodes cut all ways";
    case NoPathCause::kTooNarrowAndBlocked:
      (*metadata)["radius_m_max"] = radius;
      return absl::StrCat(
          "blocked nodes cut ways, and those left open are too narrow; without them the widest "
          "way admits ",
          radius, " m");
    case NoPathCause::kNotAtThatTime:
      return "the places were linked at other times, not at the one asked for";
    case NoPathCause::kApart:
      break;
  }
  return absl::StrCat("the places of the start (", RoomText(reason.from_room), ") and of the end (",
                      RoomText(reason.to_room),
                      ") are not linked: the map has no chain of places between them, which comes "
                      "from mapping the way or from seeing somebody walk it");
}

}  // namespace dsg::query
