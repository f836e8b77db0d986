// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/tracks/presence.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

/// Up to this fraction of a straight piece, one is in this room.
struct Part {
  double end = 1.0;
  int room = 0;
};

std::vector<Part> RoomsAlong(const FloorPlan& plan, const Point& from, const Point& to) {
  const int first = plan.RoomAt(from);
  // Cells are convex: what begins and ends in one does not leave it.
  if (plan.rooms[first].Contains(to)) return {{1.0, first}};
  std::vector<double> cuts = {1.0};
  const Point step = to - from;
  for (const Room& room : plan.rooms) {
    for (const Point& corner : {room.cell.min(), room.cell.max()}) {
      for (int axis = 0; axis < 2; ++axis) {
        const double cut = (corner[axis] - from[axis]) / step[axis];
        // Also false for a piece along the line.
        if (cut > 0.0 && cut < 1.0) cuts.push_back(cut);
      }
    }
  }
  std::sort(cuts.begin(), cuts.end());
  std::vector<Part> parts;
  double begin = 0.0;
  for (const double end : cuts) {
    const Point middle = from + 0.5 * (begin + end) * step;
    if (end > begin) parts.push_back({end, plan.RoomAt(middle)});
    begin = end;
  }
  return parts;
}

void Append(int room, TimeNs exit_ns, std::vector<RoomVisit>* visits) {
  if (!visits->empty() && visits->back().room == room) {
    visits->back().exit_ns = exit_ns;
    return;
  }
  const TimeNs enter_ns = visits->empty() ? 0 : visits->back().exit_ns;
  if (exit_ns > enter_ns) visits->push_back({room, enter_ns, exit_ns});
}

void AppendLeg(const FloorPlan& plan, const Leg& leg, std::vector<RoomVisit>* visits) {
  const std::vector<Point>& points = leg.path.points();
  Append(plan.RoomAt(points.front()), leg.depart_ns, visits);
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const double length = leg.path.DistanceAt(i + 1) - leg.path.DistanceAt(i);
    for (const Part& part : RoomsAlong(plan, points[i], points[i + 1])) {
      const double time_s = leg.profile.TimeAt(leg.path.DistanceAt(i) + part.end * length);
      const TimeNs exit_ns =
          leg.depart_ns +
          static_cast<TimeNs>(std::llround(time_s * static_cast<double>(kNsPerSecond)));
      Append(part.room, exit_ns, visits);
    }
  }
}

}  // namespace

std::vector<RoomVisit> RoomVisits(const FloorPlan& plan, TimeNs until_ns, Walker* walker) {
  std::vector<RoomVisit> visits;
  while (true) {
    AppendLeg(plan, walker->leg(), &visits);
    if (walker->leg().end_ns >= until_ns) break;
    walker->NextLeg();
  }
  while (visits.back().enter_ns >= until_ns) visits.pop_back();
  visits.back().exit_ns = until_ns;
  return visits;
}

}  // namespace dsg::simulator
