// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "schema/codec/proto_convert.h"
#include "tests/property/question.h"

namespace dsg::test {
namespace {

bool IsSymmetric(const std::string& relation) {
  static const std::set<std::string> kSymmetric = {"ADJACENT", "CO_VISIBLE", "NEAR", "SAME_AS",
                                                   "TRAVERSABLE"};
  return kSymmetric.contains(relation);
}

bool SelectsAgents(const NaiveMap& map, const v1::NodePattern& pattern) {
  if (pattern.kind() == "human" || pattern.kind() == "robot") return true;
  if (pattern.layer() == "agents") return true;
  for (const auto& [id, node] : map.nodes) {
    if (ToString(id) == pattern.id() && node.layer == layers::kAgents) return true;
  }
  for (const v1::Alternatives& alternatives : pattern.alternatives()) {
    for (const v1::NodePattern& one : alternatives.any_of()) {
      if (!alternatives.negated() && SelectsAgents(map, one)) return true;
    }
  }
  return false;
}

/// A search by somebody who compares every node with every other one.
class Scanner {
 public:
  Scanner(const NaiveMap& map, std::optional<TimeNs> at_ns) : map_(map), at_ns_(at_ns) {}

  /// Every name and relation is one of the map; ids are.
  bool KnowsWords(const v1::NodePattern& pattern) const {
    const std::string& name = pattern.name();
    if (!name.empty() && !name.ends_with('*') &&
        std::ranges::none_of(map_.nodes,
                             [&](const auto& entry) { return IsNamed(entry.second, name); })) {
      return false;
    }
    for (const v1::RelationCondition& condition : pattern.relations()) {
      const bool is_custom = condition.relation() == "custom";
      const auto is_it = [](const auto& entry) { return entry.first.relation == "custom"; };
      if (is_custom && std::ranges::none_of(map_.edges, is_it)) return false;
      if (!KnowsWords(condition.other())) return false;
    }
    for (const v1::Alternatives& alternatives : pattern.alternatives()) {
      for (const v1::NodePattern& one : alternatives.any_of()) {
        if (!KnowsWords(one)) return false;
      }
    }
    return true;
  }

  bool Matches(const Node& node, const v1::NodePattern& pattern) {
    if (!Holds(node.valid, at_ns_)) return false;
    if (!pattern.id().empty() && ToString(node.id) != pattern.id()) return false;
    if (!pattern.kind().empty() && node.kind != pattern.kind()) return false;
    if (!pattern.layer().empty() && LayerTable().Find(node.layer)->name != pattern.layer()) {
      return false;
    }
    if (!pattern.class_name().empty() &&
        node.class_name != absl::AsciiStrToLower(pattern.class_name())) {
      return false;
    }
    if (!pattern.name().empty() && !IsNamed(node, pattern.name())) return false;
    for (const v1::RelationCondition& condition : pattern.relations()) {
      if (Related(node, condition).empty() != condition.negated()) return false;
    }
    for (const v1::Alternatives& alternatives : pattern.alternatives()) {
      bool is_any = false;
      for (const v1::NodePattern& one : alternatives.any_of()) {
        is_any = is_any || Matches(node, one);
      }
      if (is_any == alternatives.negated()) return false;
    }
    return true;
  }

  /// The node that a hit shows for a relation; empty if there is none.
  NodeId Related(const Node& node, const v1::RelationCondition& condition) {
    const std::string& relation = condition.relation();
    NodeId lowest;
    for (const auto& [key, edge] : map_.edges) {
      if (key.relation != relation || !Holds(edge.valid, at_ns_)) continue;
      const bool both = IsSymmetric(relation);
      NodeId other;
      if (key.source == node.id && (both || !condition.reversed())) other = key.target;
      if (key.target == node.id && (both || condition.reversed())) other = key.source;
      if (other.empty() || !Matches(map_.nodes.at(other), condition.other())) continue;
      if (lowest.empty() || other < lowest) lowest = other;
    }
    if (!lowest.empty() || (relation != "IN" && relation != "INSIDE")) return lowest;
    std::pair<int, NodeId> nearest{1000, NodeId()};
    for (const auto& [id, other] : map_.nodes) {
      const auto& above = condition.reversed() ? Above(id) : Above(node.id);
      const auto level = above.find(condition.reversed() ? node.id : id);
      if (level == above.end() || !Matches(other, condition.other())) continue;
      nearest = std::min(nearest, std::pair(level->second, id));
    }
    return nearest.second;
  }

 private:
  static bool IsNamed(const Node& node, const std::string& name) {
    const std::string lower = absl::AsciiStrToLower(name);
    if (!lower.ends_with('*')) return node.name == lower;
    return !node.name.empty() && node.name.starts_with(lower.substr(0, lower.size() - 1));
  }

  /// What is above a node, with how far: for agents, above where they stay.
  const std::map<NodeId, int>& Above(NodeId id) {
    const auto known = above_.find(id);
    if (known != above_.end()) return known->second;
    std::map<NodeId, int> above;
    std::vector<NodeId> level = {id};
    for (int distance = 1; !level.empty(); ++distance) {
      std::vector<NodeId> next;
      const auto add = [&](NodeId parent) {
        const auto node = map_.nodes.find(parent);
        if (node == map_.nodes.end() || !Holds(node->second.valid, at_ns_)) return;
        if (above.emplace(parent, distance).second) next.push_back(parent);
      };
      for (const NodeId child : level) {
        for (const auto& [key, edge] : map_.edges) {
          if (key.target == child && key.relation == "CONTAINS" && Holds(edge.valid, at_ns_)) {
            add(key.source);
          }
        }
      }
      for (const auto& [key, stay] : map_.stays) {
        if (distance > 1 || stay.agent != id) continue;
        if (at_ns_.has_value() && (*at_ns_ < stay.enter_ns || *at_ns_ >= ExitOf(map_, stay))) {
          continue;
        }
        for (const NodeId where : {stay.place, stay.room}) add(where);
      }
      level = std::move(next);
    }
    return above_.emplace(id, std::move(above)).first->second;
  }

  const NaiveMap& map_;
  std::optional<TimeNs> at_ns_;
  std::map<NodeId, std::map<NodeId, int>> above_;
};

std::string AnyName(Random* random) {
  const int number = random->Index(20);
  switch (random->Index(5)) {
    case 0:
      return "room" + std::to_string(number % 4);
    case 1:
      return "Person" + std::to_string(number % RandomWorld::kPeople);
    case 2:
      return "thing1*";
    default:
      return "thing" + std::to_string(number);
  }
}

v1::NodePattern AnyPattern(const NaiveMap& map, Random* random, int depth);

void AddAnyRelation(const NaiveMap& map, Random* random, int depth, v1::NodePattern* pattern) {
  static constexpr const char* kRelations[] = {"INSIDE",   "INSIDE", "IN",          "IN",
                                               "CONTAINS", "ON",     "TRAVERSABLE", "custom"};
  v1::RelationCondition* relation = pattern->add_relations();
  relation->set_relation(kRelations[random->Index(8)]);
  relation->set_reversed(random->Chance(0.3));
  relation->set_negated(random->Chance(0.2));
  *relation->mutable_other() = AnyPattern(map, random, depth - 1);
}

v1::NodePattern AnyPattern(const NaiveMap& map, Random* random, int depth) {
  static constexpr const char* kKinds[] = {"object", "object", "place",     "room",
                                           "human",  "robot",  "structure", "building"};
  static constexpr const char* kLayers[] = {"objects", "places", "rooms", "agents"};
  static constexpr const char* kClassNames[] = {"cup", "Chair", "table"};
  v1::NodePattern pattern;
  const double what = random->Uniform();
  if (what < 0.4) {
    pattern.set_kind(kKinds[random->Index(8)]);
  } else if (what < 0.5) {
    pattern.set_layer(kLayers[random->Index(4)]);
  } else if (what < 0.65) {
    pattern.set_class_name(kClassNames[random->Index(3)]);
  } else if (what < 0.75) {
    pattern.set_name(AnyName(random));
  } else if (what < 0.82) {
    pattern.set_id(ToString(AnyNode(map, random)));
  }
  if (depth == 0) return pattern;
  while (random->Chance(0.4)) AddAnyRelation(map, random, depth, &pattern);
  while (random->Chance(0.3)) {
    v1::Alternatives* alternatives = pattern.add_alternatives();
    alternatives->set_negated(random->Chance(0.35));
    for (int i = random->Integer(1, 3); i > 0; --i) {
      *alternatives->add_any_of() = AnyPattern(map, random, depth - 1);
    }
  }
  return pattern;
}

int CountConditions(const v1::NodePattern& pattern) {
  int count = pattern.relations_size();
  for (const v1::RelationCondition& relation : pattern.relations()) {
    count += CountConditions(relation.other());
  }
  for (const v1::Alternatives& alternatives : pattern.alternatives()) {
    count += alternatives.any_of_size();
    for (const v1::NodePattern& one : alternatives.any_of()) count += CountConditions(one);
  }
  return count;
}

// Not longer than a search takes.
v1::NodePattern AnyPattern(const NaiveMap& map, Random* random) {
  constexpr int kConditionsMax = 64;
  v1::NodePattern pattern;
  do {
    pattern = AnyPattern(map, random, 2);
  } while (CountConditions(pattern) > kConditionsMax);
  return pattern;
}

// Who is, or was, where: half of what these questions are for.
v1::NodePattern AnyAgentPattern(const NaiveMap& map, Random* random) {
  static constexpr const char* kAbove[] = {"room", "place", "building"};
  v1::NodePattern agent;
  agent.set_kind(random->Chance(0.8) ? "human" : "robot");
  v1::NodePattern where = AnyPattern(map, random, random->Integer(0, 1));
  if (random->Chance(0.7)) {
    where.Clear();
    where.set_kind(kAbove[random->Index(3)]);
  }
  const bool is_agent_asked = random->Chance(0.6);
  v1::NodePattern pattern = is_agent_asked ? agent : where;
  v1::RelationCondition* relation = pattern.add_relations();
  relation->set_relation(random->Chance(0.5) ? "IN" : "INSIDE");
  relation->set_reversed(!is_agent_asked);
  relation->set_negated(random->Chance(0.2));
  *relation->mutable_other() = is_agent_asked ? where : agent;
  return pattern;
}

ComparedAnswer ScanHits(const NaiveMap& map, const v1::SearchNodesRequest& request) {
  const v1::NodePattern& pattern = request.pattern();
  const auto at_ns = request.has_at_ns() ? std::optional(request.at_ns()) : std::nullopt;
  Scanner scanner(map, at_ns);
  if (!scanner.KnowsWords(pattern)) return ErrorAnswer(absl::StatusCode::kNotFound);
  const bool in_space = request.has_near() || request.has_box();
  const bool wants_agents = SelectsAgents(map, pattern);
  if (in_space && wants_agents && !at_ns.has_value()) {
    return ErrorAnswer(absl::StatusCode::kInvalidArgument);
  }
  const auto point = [](const v1::Vector3& in) { return Eigen::Vector3d(in.x(), in.y(), in.z()); };
  const Box3d box(point(request.box().min()), point(request.box().max()));
  std::vector<std::pair<double, NodeId>> found;
  for (const auto& [id, stored] : map.nodes) {
    if (!scanner.Matches(stored, pattern)) continue;
    const auto [node, is_there, has_pose] = NodeAt(map, stored, at_ns);
    if (!is_there) continue;
    if (in_space && node.layer == layers::kAgents && (!wants_agents || !has_pose)) continue;
    if (request.has_box() && !node.BoxMap().intersects(box)) continue;
    const double distance_m = request.has_near() ? node.DistanceTo(point(request.near())) : 0.0;
    if (request.max_distance_m() > 0.0 && distance_m > request.max_distance_m()) continue;
    found.emplace_back(distance_m, id);
  }
  std::sort(found.begin(), found.end());
  ComparedAnswer answer;
  if (request.count_only()) {
    answer.words.push_back(found.empty() ? "nothing" : std::to_string(found.size()));
    return answer;
  }
  for (const auto& [distance_m, id] : found) {
    std::string word = ToString(id);
    for (const v1::RelationCondition& condition : pattern.relations()) {
      const Node& node = map.nodes.at(id);
      word += " " + (condition.negated() ? "" : ToString(scanner.Related(node, condition)));
    }
    answer.words.push_back(std::move(word));
    if (request.has_near()) answer.numbers.push_back(distance_m);
  }
  return answer;
}

ComparedAnswer AskHits(Asker* asker, Revision revision, const v1::SearchNodesRequest& request) {
  int64_t hit_count = 0;
  ComparedAnswer answer = AllPages<v1::SearchNodesRequest, v1::SearchNodesResponse>(
      asker, revision, request, &query::Api::SearchNodes,
      [&](const v1::SearchNodesResponse& page, ComparedAnswer* out) {
        hit_count = page.hit_count();
        for (const v1::SearchHit& hit : page.hits()) {
          std::string word = hit.node().id();
          for (const std::string& related : hit.related_ids()) word += " " + related;
          out->words.push_back(std::move(word));
          if (request.has_near()) out->numbers.push_back(hit.distance_m());
        }
      });
  if (request.count_only() && answer.words.empty()) {
    answer.words.push_back(hit_count == 0 ? "nothing" : std::to_string(hit_count));
  }
  return answer;
}

// The same pattern as a text: as the engine itself writes it.
v1::SearchNodesRequest AsText(Asker* asker, Revision revision, v1::SearchNodesRequest request) {
  v1::SearchNodesRequest first = request;
  first.set_map(QuestionWorld::kMap);
  *first.mutable_read_at() = asker->ReadAt(revision);
  first.set_page_size(1);
  v1::SearchNodesResponse reply;
  if (asker->core()->SearchNodes(asker->call, first, &reply).ok()) {
    request.set_query(reply.canonical_query());
  }
  return request;
}

Question MakeSearch(const QuestionWorld& world, Random* random, bool in_space) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  v1::SearchNodesRequest request;
  *request.mutable_pattern() =
      random->Chance(0.4) ? AnyAgentPattern(map, random) : AnyPattern(map, random);
  if (random->Chance(in_space ? 0.7 : 0.5)) request.set_at_ns(AnyTime(map, random));
  if (in_space) {
    const bool has_box = random->Chance(0.4);
    if (!has_box || random->Chance(0.3)) {
      SetPoint(AnyPoint(map, random), request.mutable_near());
      if (random->Chance(0.4)) request.set_max_distance_m(random->Integer(1, 40));
    }
    if (has_box) {
      const Eigen::Vector3d low = AnyPoint(map, random);
      SetPoint(low, request.mutable_box()->mutable_min());
      SetPoint(low + Eigen::Vector3d::Constant(random->Integer(5, 60)),
               request.mutable_box()->mutable_max());
    }
  }
  request.set_count_only(random->Chance(0.2));
  request.set_explain(random->Chance(0.2));
  request.set_view(v1::NODE_VIEW_BASIC);
  const bool as_text = random->Chance(0.5);
  Question made;
  made.text = request.ShortDebugString();
  // Where an agent was between two poses is computed in another way.
  made.tolerance = 1e-9;
  made.scan = [&map, request] { return ScanHits(map, request); };
  made.ask = [request, revision, as_text](Asker* asker) {
    return AskHits(asker, revision, as_text ? AsText(asker, revision, request) : request);
  };
  return made;
}

}  // namespace

std::vector<QuestionKind> SearchQuestions() {
  return {
      {"search",
       [](const QuestionWorld& world, Random* random) { return MakeSearch(world, random, false); }},
      {"search in space",
       [](const QuestionWorld& world, Random* random) { return MakeSearch(world, random, true); },
       true}};
}

}  // namespace dsg::test
