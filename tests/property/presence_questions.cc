// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "tests/property/question.h"

namespace dsg::test {
namespace {

/// Sorts as the answer does.
struct Visit {
  TimeNs enter_ns = 0;
  NodeId agent;
  NodeId node;
  TimeNs exit_ns = 0;
  auto operator<=>(const Visit&) const = default;
};

// Joins those of one agent and node that touch, clips them, puts them in order. `visits` may come
// in any order.
std::vector<Visit> Joined(std::vector<Visit> visits, const Interval& during) {
  std::sort(visits.begin(), visits.end(), [](const Visit& a, const Visit& b) {
    return std::tie(a.agent, a.node, a.enter_ns) < std::tie(b.agent, b.node, b.enter_ns);
  });
  std::vector<Visit> joined;
  for (const Visit& visit : visits) {
    if (!joined.empty() && joined.back().agent == visit.agent && joined.back().node == visit.node &&
        visit.enter_ns <= joined.back().exit_ns) {
      joined.back().exit_ns = std::max(joined.back().exit_ns, visit.exit_ns);
    } else {
      joined.push_back(visit);
    }
  }
  for (Visit& visit : joined) {
    visit.enter_ns = std::max(visit.enter_ns, during.from_ns);
    visit.exit_ns = std::min(visit.exit_ns, during.to_ns);
  }
  std::erase_if(joined, [](const Visit& visit) { return visit.enter_ns >= visit.exit_ns; });
  std::sort(joined.begin(), joined.end());
  return joined;
}

int CountObserved(const NaiveMap& map, const Interval& during) {
  int count = 0;
  for (const auto& [agent, track] : map.tracks) {
    bool observed = false;
    for (auto pose = track.begin(); pose != track.end(); ++pose) {
      const auto next = std::next(pose);
      const bool joined = next != track.end() && next->first - pose->first <= 2 * kNsPerSecond;
      const TimeNs seen_to = joined ? next->first : pose->first;
      observed = observed || (pose->first < during.to_ns && seen_to >= during.from_ns);
    }
    if (observed) ++count;
  }
  return count;
}

ComparedAnswer ToAnswer(const NaiveMap& map, const std::vector<Visit>& visits,
                        const Interval& during) {
  ComparedAnswer answer;
  for (const Visit& visit : visits) {
    answer.words.push_back(ToString(visit.agent) + " " + ToString(visit.node));
    answer.numbers.push_back(static_cast<double>(visit.enter_ns));
    answer.numbers.push_back(static_cast<double>(visit.exit_ns));
  }
  answer.numbers.push_back(CountObserved(map, during));
  return answer;
}

ComparedAnswer AskPresence(Asker* asker, Revision revision,
                           const v1::ListPresenceRequest& request) {
  int64_t observed_count = 0;
  ComparedAnswer answer = AllPages<v1::ListPresenceRequest, v1::ListPresenceResponse>(
      asker, revision, request, &query::Api::ListPresence,
      [&](const v1::ListPresenceResponse& page, ComparedAnswer* out) {
        for (const v1::PresenceInterval& visit : page.intervals()) {
          out->words.push_back(visit.agent_id() + " " + visit.node_id());
          out->numbers.push_back(static_cast<double>(visit.enter_ns()));
          out->numbers.push_back(static_cast<double>(visit.exit_ns()));
        }
        observed_count = page.observed_agent_count();
      });
  const bool failed = answer.words.size() == 1 && answer.numbers.empty();
  if (!failed) answer.numbers.push_back(static_cast<double>(observed_count));
  return answer;
}

Interval AnyDuring(const NaiveMap& map, Random* random) {
  TimeNs from_ns = AnyTime(map, random);
  TimeNs to_ns = AnyTime(map, random);
  if (random->Chance(0.2)) to_ns = 1000 * kNsPerSecond;
  if (to_ns < from_ns) std::swap(from_ns, to_ns);
  return {from_ns, to_ns + 1};
}

std::vector<Visit> ScanStays(const NaiveMap& map, const std::set<NodeId>& nodes) {
  std::vector<Visit> visits;
  for (const auto& [key, stay] : map.stays) {
    for (const NodeId node : {stay.room, stay.place}) {
      if (!node.empty() && nodes.contains(node)) {
        visits.push_back({stay.enter_ns, stay.agent, node, ExitOf(map, stay)});
      }
    }
  }
  return visits;
}

Question MakePresence(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  const Interval during = AnyDuring(map, random);
  const double what = random->Uniform();
  NodeId where('R', static_cast<uint64_t>(random->Index(4)));
  if (what < 0.4) where = NodeId('q', static_cast<uint64_t>(random->Index(12)));
  if (what < 0.2) where = NodeId('B', 1);
  if (what < 0.05) where = AnyNode(map, random);
  v1::ListPresenceRequest request;
  request.set_node_id(ToString(where));
  request.set_from_ns(during.from_ns);
  request.set_to_ns(during.to_ns);
  Question made;
  made.text = request.ShortDebugString();
  made.scan = [&map, where, during] {
    const LayerId layer = map.nodes.at(where).layer;
    std::set<NodeId> nodes = {where};
    if (layer == layers::kBuildings) {
      nodes.clear();
      for (const auto& [key, edge] : map.edges) {
        if (key.source == where && edge.valid.Overlaps(during)) nodes.insert(key.target);
      }
    } else if (layer != layers::kRooms && layer != layers::kPlaces) {
      return ErrorAnswer(absl::StatusCode::kInvalidArgument);
    }
    return ToAnswer(map, Joined(ScanStays(map, nodes), during), during);
  };
  made.ask = [request, revision](Asker* asker) { return AskPresence(asker, revision, request); };
  return made;
}

// The part of the way from `a` to `b` inside the box, as fractions; nullopt if none.
std::optional<std::pair<double, double>> Inside(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                                const Box3d& box) {
  double begin = 0.0;
  double end = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = b[axis] - a[axis];
    if (way == 0.0) {
      if (a[axis] < box.min()[axis] || a[axis] > box.max()[axis]) return std::nullopt;
      continue;
    }
    const double at_min = (box.min()[axis] - a[axis]) / way;
    const double at_max = (box.max()[axis] - a[axis]) / way;
    begin = std::max(begin, std::min(at_min, at_max));
    end = std::min(end, std::max(at_min, at_max));
  }
  if (begin > end) return std::nullopt;
  return std::pair(begin, end);
}

std::vector<Visit> ScanBox(const NaiveMap& map, const Box3d& box) {
  std::vector<Visit> visits;
  for (const auto& [agent, track] : map.tracks) {
    for (auto pose = track.begin(); pose != track.end(); ++pose) {
      const Eigen::Vector3d& from = pose->second.map_T_agent.position;
      if (box.contains(from)) visits.push_back({pose->first, agent, NodeId(), pose->first + 1});
      const auto next = std::next(pose);
      if (next == track.end() || next->first - pose->first > 2 * kNsPerSecond) continue;
      const auto part = Inside(from, next->second.map_T_agent.position, box);
      if (!part.has_value()) continue;
      const auto span = static_cast<double>(next->first - pose->first);
      const TimeNs enter_ns = pose->first + static_cast<TimeNs>(std::ceil(part->first * span));
      const TimeNs last_ns = pose->first + static_cast<TimeNs>(std::floor(part->second * span));
      // Crossed a corner between two nanoseconds.
      if (enter_ns <= last_ns) visits.push_back({enter_ns, agent, NodeId(), last_ns + 1});
    }
  }
  return visits;
}

Question MakeBoxPresence(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  Interval during = AnyDuring(map, random);
  if (random->Chance(0.4)) during = {0, 1000 * kNsPerSecond};
  // Around where somebody was.
  Eigen::Vector3d center = AnyPoint(map, random);
  const NodeId agent = RandomWorld::Person(random->Index(RandomWorld::kPeople));
  const auto at = LocateNaively(map, agent, AnyTime(map, random));
  if (at.has_value()) center = at->map_T_agent.position;
  const Eigen::Vector3d half(random->Uniform(0.02, 1), random->Uniform(0.02, 1),
                             random->Uniform(0.02, 1));
  const Box3d box(center - half, center + half * random->Uniform(0, 1));
  v1::ListPresenceRequest request;
  SetPoint(box.min(), request.mutable_box()->mutable_min());
  SetPoint(box.max(), request.mutable_box()->mutable_max());
  request.set_from_ns(during.from_ns);
  request.set_to_ns(during.to_ns);
  Question made;
  made.text = request.ShortDebugString();
  // Of a division, rounded to whole nanoseconds.
  made.tolerance = 1.0;
  made.scan = [&map, box, during] {
    return ToAnswer(map, Joined(ScanBox(map, box), during), during);
  };
  made.ask = [request, revision](Asker* asker) { return AskPresence(asker, revision, request); };
  return made;
}

}  // namespace

std::vector<QuestionKind> PresenceQuestions() {
  return {{"presence", MakePresence}, {"presence in a box", MakeBoxPresence, true}};
}

}  // namespace dsg::test
