// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include "schema/base/status.h"
#include "tests/property/question.h"

namespace dsg::test {
namespace {

struct PathQuestionScan {
  NodeId from;
  NodeId to;
  double radius_m = 0.0;
  std::vector<NodeId> blocked;
  std::optional<TimeNs> at_ns;
};

class WalkScan {
 public:
  WalkScan(const NaiveMap& map, const PathQuestionScan& question) : map_(map), question_(question) {
    for (const NodeId id : question.blocked) {
      blocked_.insert(id);
      const auto below = AllBelow(map, id);
      blocked_.insert(below.begin(), below.end());
    }
    for (const auto& [key, edge] : map.edges) {
      if (key.relation != relations::kTraversable || !IsThere(edge.valid)) continue;
      if (edge.weight < question.radius_m) continue;
      if (!IsOpen(key.source) || !IsOpen(key.target)) continue;
      links_[key.source].insert(key.target);
      links_[key.target].insert(key.source);
    }
  }

  ComparedAnswer Run() const {
    const std::set<NodeId> goals = Ends(question_.to);
    std::map<NodeId, double> settled;
    std::set<std::pair<double, NodeId>> queue;
    for (const NodeId start : Ends(question_.from)) queue.insert({0.0, start});
    while (!queue.empty()) {
      const auto [way_m, place] = *queue.begin();
      queue.erase(queue.begin());
      if (goals.contains(place)) return {{"path"}, {way_m}};
      if (!settled.insert({place, way_m}).second) continue;
      const auto links = links_.find(place);
      if (links == links_.end()) continue;
      for (const NodeId next : links->second) {
        const double step_m = (PositionOf(next) - PositionOf(place)).norm();
        if (!settled.contains(next)) queue.insert({way_m + step_m, next});
      }
    }
    return {{"no path"}, {}};
  }

 private:
  const Eigen::Vector3d& PositionOf(NodeId id) const {
    return map_.nodes.at(id).map_T_node.position;
  }

  bool IsThere(const Interval& valid) const {
    return question_.at_ns.has_value() ? Holds(valid, question_.at_ns) : valid.to_ns == kTimeMax;
  }

  bool IsOpen(NodeId id) const {
    const Node& node = map_.nodes.at(id);
    return node.place.has_value() && node.place->clearance_m >= question_.radius_m &&
           IsThere(node.valid) && !blocked_.contains(id);
  }

  // The place, or those below the node.
  std::set<NodeId> Ends(NodeId id) const {
    const Node& node = map_.nodes.at(id);
    std::set<NodeId> ends;
    if (!IsThere(node.valid)) return ends;
    if (node.place.has_value() && IsOpen(id)) ends.insert(id);
    for (const NodeId below : AllBelow(map_, id)) {
      if (map_.nodes.at(below).place.has_value() && IsOpen(below)) ends.insert(below);
    }
    return ends;
  }

  const NaiveMap& map_;
  const PathQuestionScan& question_;
  std::set<NodeId> blocked_;
  std::map<NodeId, std::set<NodeId>> links_;
};

bool HasPlace(const NaiveMap& map, NodeId id) {
  if (map.nodes.at(id).place.has_value()) return true;
  const auto below = AllBelow(map, id);
  return std::any_of(below.begin(), below.end(),
                     [&](NodeId child) { return map.nodes.at(child).place.has_value(); });
}

// A place, or sometimes a room or the building if there are places in it: an empty room is gone to
// by what is near, which is not a scan's business.
NodeId AnyEnd(const NaiveMap& map, Random* random) {
  std::vector<NodeId> places;
  for (const auto& [id, node] : map.nodes) {
    if (node.place.has_value()) places.push_back(id);
  }
  if (random->Chance(0.2)) {
    const NodeId room =
        random->Chance(0.1) ? NodeId('B', 1) : NodeId('R', static_cast<uint64_t>(random->Index(4)));
    if (HasPlace(map, room)) return room;
  }
  return places[static_cast<size_t>(random->Index(static_cast<int>(places.size())))];
}

PathQuestionScan AnyPath(const NaiveMap& map, Random* random) {
  PathQuestionScan question;
  question.from = AnyEnd(map, random);
  question.to = AnyEnd(map, random);
  // Exactly as wide as some links are, too.
  if (random->Chance(0.5)) question.radius_m = random->Integer(1, 4) / 4.0;
  if (random->Chance(0.2)) question.radius_m = random->Uniform(0, 1.5);
  for (int i = random->Chance(0.3) ? random->Integer(1, 4) : 0; i > 0; --i) {
    const NodeId blocked = AnyEnd(map, random);
    if (blocked.letter() != 'B') question.blocked.push_back(blocked);
  }
  if (random->Chance(0.5)) question.at_ns = AnyTime(map, random);
  return question;
}

Question MakePath(const QuestionWorld& world, Random* random, v1::PlanMode mode) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  const PathQuestionScan question = AnyPath(map, random);
  v1::PlanPathRequest request;
  request.set_map(QuestionWorld::kMap);
  request.mutable_from()->set_node(ToString(question.from));
  request.mutable_to()->set_node(ToString(question.to));
  request.set_robot_radius_m(question.radius_m);
  for (const NodeId id : question.blocked) request.add_blocked(ToString(id));
  if (question.at_ns.has_value()) request.set_at_ns(*question.at_ns);
  request.set_mode(mode);
  Question made;
  made.text = request.ShortDebugString();
  made.tolerance = 1e-9;
  made.stretch = mode == v1::FLAT ? 0.0 : 0.03;
  made.scan = [&map, question] { return WalkScan(map, question).Run(); };
  made.ask = [request, revision](Asker* asker) {
    v1::PlanPathRequest asked = request;
    *asked.mutable_read_at() = asker->ReadAt(revision);
    v1::PlanPathResponse reply;
    const absl::Status status = asker->core()->PlanPath(asker->call, asked, &reply);
    if (ReasonOf(status) == Reason::kNoPath) return ComparedAnswer{{"no path"}, {}};
    if (!status.ok()) return ErrorAnswer(status);
    return ComparedAnswer{{"path"}, {reply.length_m()}};
  };
  return made;
}

Question MakeFlatPath(const QuestionWorld& world, Random* random) {
  return MakePath(world, random, v1::FLAT);
}

Question MakeHierarchicalPath(const QuestionWorld& world, Random* random) {
  return MakePath(world, random, v1::HIERARCHICAL);
}

}  // namespace

std::vector<QuestionKind> PathQuestions() {
  return {{"path, flat", MakeFlatPath}, {"path, hierarchical", MakeHierarchicalPath}};
}

}  // namespace dsg::test
