// SPDX-License-Identifier: Apache-2.0
#include "tests/property/question.h"

#include <algorithm>
#include <set>

#include "schema/codec/proto_convert.h"

namespace dsg::test {

v1::ReadAt Asker::ReadAt(Revision revision) const {
  v1::ReadAt at;
  if (revision == world->head()) {
    at.set_latest(true);
  } else {
    at.set_exact_revision(world->StoredRevision(revision));
  }
  return at;
}

ComparedAnswer ErrorAnswer(const absl::Status& status) { return ErrorAnswer(status.code()); }

ComparedAnswer ErrorAnswer(absl::StatusCode code) {
  return {{"error " + absl::StatusCodeToString(code)}, {}};
}

std::string TextOf(v1::Node node) {
  node.clear_revision();
  return node.SerializeAsString();
}

std::string TextOf(const Node& node) {
  v1::Node out;
  ToProto(node, LayerTable(), &out);
  return TextOf(std::move(out));
}

std::string TextOf(v1::Edge edge) {
  edge.clear_revision();
  return edge.SerializeAsString();
}

std::string TextOf(const Edge& edge) {
  v1::Edge out;
  ToProto(edge, &out);
  return TextOf(std::move(out));
}

NodeId AnyNode(const NaiveMap& map, Random* random) {
  return std::next(map.nodes.begin(), random->Index(static_cast<int>(map.nodes.size())))->first;
}

TimeNs AnyTime(const NaiveMap& map, Random* random) {
  const double scale = random->Uniform();
  if (scale < 0.3) return random->Integer(-10, 210);
  if (scale < 0.5) return random->Integer(0, 1'000'000);
  const auto track = map.tracks.find(RandomWorld::Person(random->Index(RandomWorld::kPeople)));
  if (track == map.tracks.end() || track->second.empty()) return random->Integer(0, 1'000'000'000);
  if (scale < 0.6) {
    const int count = static_cast<int>(track->second.size());
    return std::next(track->second.begin(), random->Index(count))->first;
  }
  const auto span = static_cast<double>(track->second.rbegin()->first);
  return static_cast<TimeNs>(random->Uniform(-0.02, 1.02) * span);
}

Eigen::Vector3d AnyPoint(const NaiveMap& map, Random* random) {
  const double scale = random->Uniform();
  // Where ties are.
  if (scale < 0.4) {
    return Eigen::Vector3d(random->Integer(-5, 5), random->Integer(-5, 5), random->Integer(0, 2));
  }
  if (scale < 0.6) return map.nodes.at(AnyNode(map, random)).map_T_node.position;
  const double half_m = scale < 0.8 ? 6.0 : 60.0;
  return Eigen::Vector3d(random->Uniform(-half_m, half_m), random->Uniform(-half_m, half_m),
                         random->Uniform(-1, 4));
}

void SetPoint(const Eigen::Vector3d& point, v1::Vector3* out) {
  out->set_x(point.x());
  out->set_y(point.y());
  out->set_z(point.z());
}

std::vector<NodeId> ParentsOf(const NaiveMap& map, NodeId id) {
  std::vector<NodeId> parents;
  for (const auto& [key, unused] : map.edges) {
    if (key.target == id && key.relation == relations::kContains) parents.push_back(key.source);
  }
  return parents;
}

std::vector<NodeId> ChildrenOf(const NaiveMap& map, NodeId id) {
  std::vector<NodeId> children;
  for (const auto& [key, unused] : map.edges) {
    if (key.source == id && key.relation == relations::kContains) children.push_back(key.target);
  }
  return children;
}

std::vector<NodeId> AllBelow(const NaiveMap& map, NodeId id) {
  std::set<NodeId> below;
  std::vector<NodeId> pending = {id};
  while (!pending.empty()) {
    const NodeId parent = pending.back();
    pending.pop_back();
    for (const NodeId child : ChildrenOf(map, parent)) {
      if (below.insert(child).second) pending.push_back(child);
    }
  }
  return {below.begin(), below.end()};
}

bool Holds(const Interval& valid, const std::optional<TimeNs>& at_ns) {
  return !at_ns.has_value() || (valid.from_ns <= *at_ns && *at_ns < valid.to_ns);
}

namespace {

TimeNs TrackEnd(const NaiveMap& map, NodeId agent) {
  const auto track = map.tracks.find(agent);
  return track == map.tracks.end() || track->second.empty() ? kTimeMax
                                                            : track->second.rbegin()->first;
}

}  // namespace

TimeNs ExitOf(const NaiveMap& map, const Stay& stay) {
  const TimeNs last_ns = TrackEnd(map, stay.agent);
  if (stay.exit_ns != kTimeMax || last_ns == kTimeMax) return stay.exit_ns;
  return std::max(stay.enter_ns, last_ns) + 1;
}

std::optional<NaiveLocation> LocateNaively(const NaiveMap& map, NodeId agent, TimeNs at_ns) {
  constexpr TimeNs kGapNs = 2 * kNsPerSecond;
  const auto track = map.tracks.find(agent);
  if (track == map.tracks.end()) return std::nullopt;
  const auto after = track->second.lower_bound(at_ns);
  if (after == track->second.end()) return std::nullopt;
  NaiveLocation at{v1::EXACT, after->second.map_T_agent, after->first, after->first};
  if (after->first == at_ns) return at;
  if (after == track->second.begin()) return std::nullopt;
  const auto before = std::prev(after);
  at.before_ns = before->first;
  const TimeNs span_ns = after->first - before->first;
  at.quality = span_ns > kGapNs ? v1::IN_GAP : v1::INTERPOLATED;
  const double share = static_cast<double>(at_ns - before->first) / static_cast<double>(span_ns);
  const Pose3d& from = before->second.map_T_agent;
  at.map_T_agent.position = (1.0 - share) * from.position + share * at.map_T_agent.position;
  at.map_T_agent.orientation = from.orientation.slerp(share, at.map_T_agent.orientation);
  return at;
}

NodeThen NodeAt(const NaiveMap& map, const Node& node, std::optional<TimeNs> at_ns) {
  NodeThen then{.node = node};
  if (!at_ns.has_value() || node.layer != layers::kAgents) return then;
  const auto at = LocateNaively(map, node.id, *at_ns);
  then.is_there = at.has_value();
  then.has_pose = at.has_value() && at->quality != v1::IN_GAP;
  if (then.has_pose) then.node.map_T_node = at->map_T_agent;
  return then;
}

void AddNode(v1::Node node, bool is_of_instant, ComparedAnswer* answer) {
  const bool is_placed = is_of_instant && IsAgentKind(node.kind()) && node.has_map_t_node();
  if (is_placed) {
    const v1::Vector3& p = node.map_t_node().position();
    answer->numbers.insert(answer->numbers.end(), {p.x(), p.y(), p.z()});
    node.clear_map_t_node();
  }
  answer->words.push_back(TextOf(std::move(node)) + (is_placed ? " was there" : ""));
}

void AddNode(const NodeThen& then, bool is_of_instant, ComparedAnswer* answer) {
  v1::Node wire;
  dsg::ToProto(then.node, LayerTable(), &wire);
  if (!then.has_pose) wire.clear_map_t_node();
  AddNode(std::move(wire), is_of_instant, answer);
}

}  // namespace dsg::test
