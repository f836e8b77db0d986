// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/carried.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "query/engine/interaction/held.h"
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
constexpr size_t kEndsMax = 8;

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

// Of two that are not the same: the later is known to be another, or the earlier to have become
// one.
bool IsExplained(const GraphView& view, NodeId left, NodeId came) {
  const std::optional<Symbol> relation = view.symbols().Find(relations::kSameAs);
  if (!relation.has_value()) return false;
  bool found = false;
  const auto find = [&](const ViewEdge&) {
    found = true;
    return false;
  };
  view.ForEachEdgeFrom(came, *relation, find);
  view.ForEachEdgeTo(left, *relation, find);
  return found;
}

bool IsLikeSized(const Box3d& a, const Box3d& b) {
  const double ratio = a.diagonal().norm() / std::max(b.diagonal().norm(), 1e-3);
  return ratio < kSizeFactor && ratio > 1.0 / kSizeFactor;
}

// Between the change and the other end, whichever comes first.
absl::Status FindVisits(const Snapshot& snapshot, const ObjectChange& change, const StopCheck& stop,
                        OtherEnd* end) {
  const Eigen::Vector3d reach(kThereM, kThereM, kHeightM);
  const Box3d there(end->box_map.min() - reach, end->box_map.max() + reach);
  const bool is_picked = change.type == ChangeType::kPicked;
  const TimeNs from_ns = is_picked ? change.earliest_ns : AddTime(end->at_ns, -kNsPerSecond);
  const TimeNs to_ns = is_picked ? end->at_ns : change.latest_ns;
  if (from_ns >= to_ns) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(end->visits, snapshot.VisitsToBox(there, from_ns, to_ns, stop));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<OtherEnd>> FindOtherEnds(const Snapshot& snapshot, const GraphView& view,
                                                    const ObjectChange& change,
                                                    const std::vector<ObjectChange>& all,
                                                    const StopCheck& stop) {
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
    if (!is_same && IsExplained(view, left.object, came.object)) continue;
    ends.push_back({other.object,
                    other.box_map,
                    is_picked ? other.latest_ns : other.earliest_ns,
                    other.latest_ns,
                    other.room,
                    is_same,
                    !FindHolds(view, other).empty(),
                    change.box_map.exteriorDistance(other.box_map),
                    {}});
  }
  std::sort(ends.begin(), ends.end(), [&](const OtherEnd& a, const OtherEnd& b) {
    const auto key = [&](const OtherEnd& end) {
      const TimeNs at_ns = is_picked ? end.at_ns : AddTime(kTimeMax, -end.at_ns);
      return std::tuple(!end.is_same_as, at_ns, end.object);
    };
    return key(a) < key(b);
  });
  if (ends.size() > kEndsMax) ends.resize(kEndsMax);
  for (OtherEnd& end : ends) DSG_RETURN_IF_ERROR(FindVisits(snapshot, change, stop, &end));
  return ends;
}

std::optional<TimeNs> FirstVisit(const OtherEnd& end, NodeId agent, TimeNs after_ns,
                                 TimeNs until_ns) {
  for (const BoxVisit& visit : end.visits) {
    if (visit.agent != agent || visit.exit_ns <= after_ns || visit.enter_ns >= until_ns) continue;
    return std::max(visit.enter_ns, after_ns);
  }
  return std::nullopt;
}

}  // namespace dsg::query
