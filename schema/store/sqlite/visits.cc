// SPDX-License-Identifier: Apache-2.0
// When was a piecewise-linear path inside a box? Exact to the nanosecond, by slabs.
#include <algorithm>
#include <cmath>

#include "schema/store/sqlite/snapshot.h"

namespace dsg::sqlite {
namespace {

// The part [begin, end] of the way from `a` to `b` inside the box, as fractions; false if none.
bool ClipToBox(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Box3d& box, double* begin,
               double* end) {
  *begin = 0.0;
  *end = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = b[axis] - a[axis];
    const double to_min = box.min()[axis] - a[axis];
    const double to_max = box.max()[axis] - a[axis];
    if (way == 0.0) {
      if (to_min > 0.0 || to_max < 0.0) return false;
      continue;
    }
    const double enter = (way > 0.0 ? to_min : to_max) / way;
    const double leave = (way > 0.0 ? to_max : to_min) / way;
    *begin = std::max(*begin, enter);
    *end = std::min(*end, leave);
  }
  return *begin <= *end;
}

// Adds the instants [first_ns, last_ns], joining them with the visit before when they touch.
void AddInstants(NodeId agent, TimeNs first_ns, TimeNs last_ns, TimeNs from_ns, TimeNs to_ns,
                 std::vector<BoxVisit>* visits) {
  const TimeNs enter_ns = std::max(first_ns, from_ns);
  const TimeNs exit_ns = std::min(last_ns + 1, to_ns);
  if (enter_ns >= exit_ns) return;
  if (!visits->empty() && visits->back().agent == agent && visits->back().exit_ns >= enter_ns) {
    visits->back().exit_ns = std::max(visits->back().exit_ns, exit_ns);
    return;
  }
  visits->push_back({agent, enter_ns, exit_ns});
}

}  // namespace

void CollectVisits(NodeId agent, const std::vector<TimedPosition>& positions, TimeNs gap_ns_max,
                   const Box3d& box, TimeNs from_ns, TimeNs to_ns, std::vector<BoxVisit>* visits) {
  for (size_t i = 0; i < positions.size(); ++i) {
    const TimedPosition& at = positions[i];
    // A pose by itself counts, also between two gaps.
    if (box.contains(at.position_map)) {
      AddInstants(agent, at.time_ns, at.time_ns, from_ns, to_ns, visits);
    }
    if (i + 1 == positions.size()) break;
    const TimedPosition& next = positions[i + 1];
    const TimeNs span_ns = next.time_ns - at.time_ns;
    if (span_ns > gap_ns_max) continue;
    double begin = 0.0;
    double end = 0.0;
    if (!ClipToBox(at.position_map, next.position_map, box, &begin, &end)) {
      continue;
    }
    const auto length = static_cast<double>(span_ns);
    AddInstants(agent, at.time_ns + static_cast<TimeNs>(std::ceil(begin * length)),
                at.time_ns + static_cast<TimeNs>(std::floor(end * length)), from_ns, to_ns, visits);
  }
}

}  // namespace dsg::sqlite
