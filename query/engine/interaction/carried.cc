// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/carried.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "query/engine/interaction/track_path.h"
#include "schema/base/status.h"
#include "schema/model/edge.h"

namespace dsg::query {
namespace {

constexpr double kThereM = 1.0;
constexpr double kHeightM = 3.0;
constexpr double kSizeFactor = 2.0;
// Later finds of the same class say less and less of this one.
constexpr TimeNs kCarryNsMax = 300 * kNsPerSecond;

std::set<NodeId> SameAs(const GraphView& view, NodeId object) {
  std::set<NodeId> same;
  const std::optional<Symbol> relation = view.symbols().Find(relations::kSameAs);
  if (!relation.has_value()) return same;
  view.ForEachEdgeFrom(object, *relation, [&](const ViewEdge& edge) {
    same.insert(edge.target);
    return true;
  });
  view.ForEachEdgeTo(object, *relation, [&](const ViewEdge& edge) {
    same.insert(edge.source);
    return true;
  });
  return same;
}

bool IsLikeSized(const Box3d& a, const Box3d& b) {
  const double ratio = a.diagonal().norm() / std::max(b.diagonal().norm(), 1e-3);
  return ratio < kSizeFactor && ratio > 1.0 / kSizeFactor;
}

}  // namespace

std::vector<OtherEnd> FindOtherEnds(const GraphView& view, const ObjectChange& change,
                                    const std::vector<ObjectChange>& all) {
  const std::set<NodeId> same = SameAs(view, change.object);
  const bool is_picked = change.type == ChangeType::kPicked;
  std::vector<OtherEnd> ends;
  for (const ObjectChange& other : all) {
    if (other.type == change.type || other.object == change.object) continue;
    const bool is_same = same.contains(other.object);
    if (!is_same &&
        (other.class_name != change.class_name || !IsLikeSized(other.box_map, change.box_map))) {
      continue;
    }
    // It cannot appear before it may have left, nor leave after it had appeared.
    const ObjectChange& left = is_picked ? change : other;
    const ObjectChange& came = is_picked ? other : change;
    if (came.latest_ns <= left.earliest_ns) continue;
    if (!is_same && AddTime(left.latest_ns, kCarryNsMax) < came.latest_ns) continue;
    ends.push_back({other.object, other.box_map, is_picked ? other.latest_ns : other.earliest_ns,
                    other.room, is_same, change.box_map.exteriorDistance(other.box_map)});
  }
  std::sort(ends.begin(), ends.end(), [&](const OtherEnd& a, const OtherEnd& b) {
    const auto key = [&](const OtherEnd& end) {
      const TimeNs at_ns = is_picked ? end.at_ns : AddTime(kTimeMax, -end.at_ns);
      return std::tuple(!end.is_same_as, at_ns, end.object);
    };
    return key(a) < key(b);
  });
  return ends;
}

absl::StatusOr<std::optional<TimeNs>> FirstVisit(const Snapshot& snapshot, NodeId agent,
                                                 const Box3d& box_map, TimeNs after_ns,
                                                 TimeNs until_ns, const StopCheck& stop) {
  if (after_ns >= until_ns) return std::nullopt;
  const Eigen::Vector3d reach(kThereM, kThereM, kHeightM);
  const Box3d there(box_map.min() - reach, box_map.max() + reach);
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       snapshot.VisitsToBox(there, after_ns, until_ns, stop));
  for (const BoxVisit& visit : visits) {
    if (visit.agent == agent) return visit.enter_ns;
  }
  return std::nullopt;
}

}  // namespace dsg::query
