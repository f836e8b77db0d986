// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/object_change.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "query/engine/interaction/track_path.h"
#include "schema/base/status.h"
#include "schema/model/edge.h"

namespace dsg::query {
namespace {

constexpr TimeNs kSettleNs = 10 * kNsPerSecond;
// From farther away robots overlook small things, along the floor.
constexpr double kLookM = 4.0;

class ChangeFinder {
 public:
  ChangeFinder(const Snapshot& snapshot, const GraphView& view, const ChangeFilter& filter,
               const StopCheck& stop)
      : snapshot_(snapshot), view_(view), filter_(filter), stop_(stop) {}

  absl::Status Begin() {
    DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot_.Stats());
    first_pose_ns_ = stats.first_pose_ns;
    contains_ = view_.symbols().Find(relations::kContains);
    return absl::OkStatus();
  }

  absl::Status Add(const ViewNode& node, std::vector<ObjectChange>* out) {
    if (!filter_.class_name.empty() &&
        view_.symbols().Text(node.class_name) != filter_.class_name) {
      return absl::OkStatus();
    }
    if (filter_.with_picked && node.valid.to_ns != kTimeMax) {
      DSG_RETURN_IF_ERROR(AddPicked(node, out));
    }
    if (filter_.with_placed && node.valid.from_ns != kTimeMin) return AddPlaced(node, out);
    return absl::OkStatus();
  }

 private:
  absl::Status AddPicked(const ViewNode& node, std::vector<ObjectChange>* out) const {
    DSG_ASSIGN_OR_RETURN(const Node full, snapshot_.GetNode(node.id));
    ObjectChange change = Describe(node, full, AddTime(node.valid.to_ns, -1));
    change.type = ChangeType::kPicked;
    change.latest_ns = node.valid.to_ns;
    // An observation after the end is of something else.
    const TimeNs seen_ns = full.last_observed_ns.value_or(node.valid.from_ns);
    change.earliest_ns = std::clamp(seen_ns, node.valid.from_ns, AddTime(node.valid.to_ns, -1));
    Keep(std::move(change), out);
    return absl::OkStatus();
  }

  absl::Status AddPlaced(const ViewNode& node, std::vector<ObjectChange>* out) {
    TimeNs look_ns = FirstLook(node);
    if (AddTime(look_ns, kSettleNs) > node.valid.from_ns) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const Node full, snapshot_.GetNode(node.id));
    DSG_RETURN_IF_ERROR(ReadRobots());
    const std::optional<TimeNs> near_ns = FirstRobotNear(full.BoxMap());
    look_ns = std::max(look_ns, near_ns.value_or(kTimeMin));
    if (AddTime(look_ns, kSettleNs) > node.valid.from_ns) return absl::OkStatus();
    ObjectChange change = Describe(node, full, node.valid.from_ns);
    change.type = ChangeType::kPlaced;
    change.earliest_ns = look_ns;
    change.is_passed_by = near_ns.has_value();
    change.latest_ns = node.valid.from_ns;
    Keep(std::move(change), out);
    return absl::OkStatus();
  }

  void Keep(ObjectChange change, std::vector<ObjectChange>* out) const {
    if (change.earliest_ns >= filter_.during.to_ns || change.latest_ns < filter_.during.from_ns) {
      return;
    }
    const bool is_below = filter_.below.empty() || filter_.below == change.object ||
                          std::find(change.ancestors.begin(), change.ancestors.end(),
                                    filter_.below) != change.ancestors.end();
    if (is_below) out->push_back(std::move(change));
  }

  absl::Status ReadRobots() {
    if (has_robots_) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const std::vector<TrackInfo> tracks, snapshot_.Tracks());
    for (const TrackInfo& track : tracks) {
      if (track.kind != kinds::kRobot || track.pose_count == 0) continue;
      DSG_ASSIGN_OR_RETURN(TrackPath path,
                           ReadTrackPath(snapshot_, track, track.first_ns, track.last_ns, stop_));
      robots_.push_back(std::move(path));
    }
    has_robots_ = true;
    return absl::OkStatus();
  }

  // nullopt where none ever came near: something else looks there.
  std::optional<TimeNs> FirstRobotNear(const Box3d& box_map) const {
    std::optional<TimeNs> first_ns;
    const Eigen::Array2d low = box_map.min().head<2>().array() - kLookM;
    const Eigen::Array2d high = box_map.max().head<2>().array() + kLookM;
    for (const TrackPath& path : robots_) {
      const auto near =
          std::find_if(path.points.begin(), path.points.end(), [&](const TrackPoint& point) {
            const Eigen::Array2d at = point.position_map.head<2>().array();
            return (at >= low).all() && (at <= high).all();
          });
      if (near == path.points.end()) continue;
      first_ns = std::min(first_ns.value_or(near->time_ns), near->time_ns);
    }
    return first_ns;
  }

  // When the place of an object was first seen; kTimeMax where nothing tells.
  TimeNs FirstLook(const ViewNode& node) const {
    const ViewNode* parent = view_.FindNode(ParentAt(node.id, node.valid.from_ns));
    if (parent != nullptr && parent->valid.from_ns != kTimeMin) return parent->valid.from_ns;
    return first_pose_ns_.value_or(kTimeMax);
  }

  // The lowest id where there are several.
  NodeId ParentAt(NodeId id, TimeNs at_ns) const {
    NodeId parent;
    if (!contains_.has_value()) return parent;
    view_.ForEachEdgeTo(id, *contains_, [&](const ViewEdge& edge) {
      if (!edge.valid.Contains(at_ns)) return true;
      parent = edge.source;
      return false;
    });
    return parent;
  }

  ObjectChange Describe(const ViewNode& node, const Node& full, TimeNs at_ns) const {
    ObjectChange change;
    change.object = node.id;
    change.name = full.name;
    change.class_name = full.class_name;
    change.box_map = full.BoxMap();
    change.observation_count = full.observation_count;
    for (NodeId parent = ParentAt(node.id, at_ns); !parent.empty();
         parent = ParentAt(parent, at_ns)) {
      change.ancestors.push_back(parent);
    }
    for (const NodeId id : change.ancestors) {
      const ViewNode* ancestor = view_.FindNode(id);
      if (ancestor == nullptr || ancestor->layer != layers::kRooms) continue;
      change.room = id;
      break;
    }
    return change;
  }

  const Snapshot& snapshot_;
  const GraphView& view_;
  const ChangeFilter& filter_;
  const StopCheck& stop_;
  std::optional<TimeNs> first_pose_ns_;
  bool has_robots_ = false;
  std::vector<TrackPath> robots_;
  std::optional<Symbol> contains_;
};

}  // namespace

absl::StatusOr<std::vector<ObjectChange>> FindChanges(const Snapshot& snapshot,
                                                      const GraphView& view,
                                                      const ChangeFilter& filter,
                                                      const StopCheck& stop) {
  ChangeFinder finder(snapshot, view, filter, stop);
  DSG_RETURN_IF_ERROR(finder.Begin());
  std::vector<ObjectChange> changes;
  if (!filter.object.empty()) {
    const ViewNode* node = view.FindNode(filter.object);
    if (node != nullptr) DSG_RETURN_IF_ERROR(finder.Add(*node, &changes));
  } else {
    int64_t count = 0;
    absl::Status status;
    view.ForEachInLayer(layers::kObjects, [&](const ViewNode& node) {
      if (stop && ++count % 256 == 0) status = stop();
      if (status.ok()) status = finder.Add(node, &changes);
      return status.ok();
    });
    DSG_RETURN_IF_ERROR(status);
  }
  std::sort(changes.begin(), changes.end(),
            [](const ObjectChange& a, const ObjectChange& b) { return KeyOf(a) < KeyOf(b); });
  return changes;
}

namespace {

// A way is seen in parts: it may be seen to begin after the thing was missed.
constexpr TimeNs kOnTheWayNs = 30 * kNsPerSecond;
// Looks at the spot and at the hand are of different pictures.
constexpr TimeNs kHoldLookNs = 2 * kNsPerSecond;
// Less speaks against it more than for it.
constexpr double kProbabilityMin = 0.5;

bool IsOfChange(const ObjectChange& change, const Interval& held) {
  if (change.type == ChangeType::kPicked) {
    return held.from_ns >= AddTime(change.earliest_ns, -kHoldLookNs) &&
           held.from_ns <= AddTime(change.latest_ns, kOnTheWayNs);
  }
  return held.to_ns >= AddTime(change.earliest_ns, -kOnTheWayNs) &&
         held.to_ns <= AddTime(change.latest_ns, kHoldLookNs);
}

}  // namespace

std::vector<Hold> FindHolds(const GraphView& view, const ObjectChange& change) {
  std::map<NodeId, Hold> holds;
  const std::optional<Symbol> held_by = view.symbols().Find(relations::kHeldBy);
  if (!held_by.has_value()) return {};
  const auto add = [&](NodeId object, double same_probability) {
    view.ForEachEdgeFrom(object, *held_by, [&](const ViewEdge& edge) {
      // What says that it is the same thing counts what says that it was held.
      const double probability = std::min(edge.weight, same_probability);
      if (!(probability > kProbabilityMin) || !IsOfChange(change, edge.valid)) return true;
      Hold& best = holds[edge.target];
      if (probability > best.probability) best = {edge.target, object, probability, edge.valid};
      return true;
    });
  };
  add(change.object, 1.0);
  const std::optional<Symbol> same_as = view.symbols().Find(relations::kSameAs);
  if (same_as.has_value()) {
    view.ForEachEdgeFrom(change.object, *same_as, [&](const ViewEdge& edge) {
      add(edge.target, edge.weight);
      return true;
    });
  }
  std::vector<Hold> found;
  found.reserve(holds.size());
  for (const auto& [agent, hold] : holds) found.push_back(hold);
  return found;
}

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
