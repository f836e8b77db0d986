// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "tests/property/question.h"

namespace dsg::test {
namespace {

// Those of the model may always be asked for, others where there are some.
std::vector<std::string> AnyRelations(const NaiveMap& map, Random* random) {
  std::vector<std::string> known = {relations::kContains, relations::kTraversable, relations::kOn,
                                    relations::kNear};
  const bool has_custom = std::any_of(map.edges.begin(), map.edges.end(), [](const auto& entry) {
    return entry.first.relation == "custom";
  });
  if (has_custom) known.push_back("custom");
  std::vector<std::string> some;
  for (const std::string& relation : known) {
    if (random->Chance(0.3)) some.push_back(relation);
  }
  return some;
}

bool Has(const std::vector<std::string>& relations, const std::string& relation) {
  return std::find(relations.begin(), relations.end(), relation) != relations.end();
}

std::string AnyIdText(const NaiveMap& map, Random* random) {
  return random->Chance(0.03) ? "O9999" : ToString(AnyNode(map, random));
}

struct NeighborsQuestion {
  std::string node;
  std::vector<std::string> relations;
  bool outgoing = false;
  bool incoming = false;
  std::optional<TimeNs> at_ns;
};

ComparedAnswer ScanNeighbors(const NaiveMap& map, const NeighborsQuestion& question) {
  const auto node = ParseNodeId(question.node);
  if (!map.nodes.contains(*node)) return ErrorAnswer(absl::StatusCode::kNotFound);
  const bool both = question.outgoing == question.incoming;
  // By the order of the answer.
  std::map<std::tuple<bool, std::string, NodeId>, const Edge*> found;
  for (const auto& [key, edge] : map.edges) {
    if (!question.relations.empty() && !Has(question.relations, key.relation)) continue;
    for (const bool is_incoming : {false, true}) {
      if (!both && is_incoming != question.incoming) continue;
      if ((is_incoming ? key.target : key.source) != *node) continue;
      const NodeId other = is_incoming ? key.source : key.target;
      if (!Holds(edge.valid, question.at_ns)) continue;
      if (!Holds(map.nodes.at(other).valid, question.at_ns)) continue;
      found[{is_incoming, key.relation, other}] = &edge;
    }
  }
  ComparedAnswer answer;
  for (const auto& [key, edge] : found) {
    answer.words.push_back(TextOf(*edge));
    answer.words.push_back(TextOf(map.nodes.at(std::get<2>(key))));
  }
  return answer;
}

Question MakeNeighbors(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  NeighborsQuestion question;
  question.node = AnyIdText(map, random);
  if (random->Chance(0.5)) question.relations = AnyRelations(map, random);
  question.outgoing = random->Chance(0.4);
  question.incoming = random->Chance(0.4);
  if (random->Chance(0.5)) question.at_ns = AnyTime(map, random);
  v1::GetNeighborsRequest request;
  request.set_id(question.node);
  request.mutable_relations()->Assign(question.relations.begin(), question.relations.end());
  request.set_outgoing(question.outgoing);
  request.set_incoming(question.incoming);
  if (question.at_ns.has_value()) request.set_at_ns(*question.at_ns);
  Question made;
  made.text = request.ShortDebugString();
  made.scan = [&map, question] { return ScanNeighbors(map, question); };
  made.ask = [request, revision](Asker* asker) {
    return AllPages<v1::GetNeighborsRequest, v1::GetNeighborsResponse>(
        asker, revision, request, &query::Api::GetNeighbors,
        [](const v1::GetNeighborsResponse& page, ComparedAnswer* answer) {
          for (const v1::Neighbor& neighbor : page.neighbors()) {
            answer->words.push_back(TextOf(neighbor.edge()));
            answer->words.push_back(TextOf(neighbor.node()));
          }
        });
  };
  return made;
}

Question MakeListEdges(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  v1::ListEdgesRequest request;
  if (random->Chance(0.4)) request.set_source(AnyIdText(map, random));
  if (random->Chance(0.4)) request.set_target(AnyIdText(map, random));
  const auto relations = AnyRelations(map, random);
  if (!relations.empty()) request.set_relation(relations.back());
  if (random->Chance(0.5)) request.set_at_ns(AnyTime(map, random));
  Question made;
  made.text = request.ShortDebugString();
  made.scan = [&map, request] {
    ComparedAnswer answer;
    for (const std::string& end : {request.source(), request.target()}) {
      if (!end.empty() && !map.nodes.contains(*ParseNodeId(end))) {
        return ErrorAnswer(absl::StatusCode::kNotFound);
      }
    }
    const auto is_meant = [](const std::string& asked, const std::string& there) {
      return asked.empty() || asked == there;
    };
    for (const auto& [key, edge] : map.edges) {
      if (request.has_at_ns() && !Holds(edge.valid, request.at_ns())) continue;
      if (is_meant(request.source(), ToString(key.source)) &&
          is_meant(request.relation(), key.relation) &&
          is_meant(request.target(), ToString(key.target))) {
        answer.words.push_back(TextOf(edge));
      }
    }
    return answer;
  };
  made.ask = [request, revision](Asker* asker) {
    return AllPages<v1::ListEdgesRequest, v1::ListEdgesResponse>(
        asker, revision, request, &query::Api::ListEdges,
        [](const v1::ListEdgesResponse& page, ComparedAnswer* answer) {
          for (const v1::Edge& edge : page.edges()) answer->words.push_back(TextOf(edge));
        });
  };
  return made;
}

struct SubgraphQuestion {
  NodeId root;
  std::vector<std::string> relations;
  bool both_directions = false;
  int depth_max = 0;
  std::string kind;
  std::optional<TimeNs> at_ns;
  std::optional<Box3d> box_map;
  bool tree_only = false;

  bool Admits(const NodeThen& then) const {
    return then.is_there && (kind.empty() || then.node.kind == kind) &&
           Holds(then.node.valid, at_ns) &&
           (!box_map.has_value() || (then.has_pose && then.node.BoxMap().intersects(*box_map)));
  }
};

// By the end that is reached, then outgoing before incoming, then by relation.
using Steps = std::map<std::tuple<NodeId, bool, std::string>, const Edge*>;

Steps StepsFrom(const NaiveMap& map, const SubgraphQuestion& question, NodeId from) {
  Steps steps;
  for (const auto& [key, edge] : map.edges) {
    if (!Has(question.relations, key.relation) || !Holds(edge.valid, question.at_ns)) continue;
    if (key.source == from) steps[{key.target, false, key.relation}] = &edge;
    if (key.target == from && question.both_directions) {
      steps[{key.source, true, key.relation}] = &edge;
    }
  }
  return steps;
}

ComparedAnswer ScanSubgraph(const NaiveMap& map, const SubgraphQuestion& question) {
  std::set<NodeId> reached = {question.root};
  std::set<NodeId> level = reached;
  std::map<EdgeKey, const Edge*> walked;
  ComparedAnswer answer;
  for (int depth = 0; !level.empty(); ++depth) {
    std::set<NodeId> deeper;
    for (const NodeId from : level) {
      AddNode(NodeAt(map, map.nodes.at(from), question.at_ns), question.at_ns.has_value(), &answer);
      if (question.depth_max > 0 && depth == question.depth_max) continue;
      for (const auto& [step, edge] : StepsFrom(map, question, from)) {
        const NodeId to = std::get<0>(step);
        if (!question.Admits(NodeAt(map, map.nodes.at(to), question.at_ns))) continue;
        if (!reached.insert(to).second) continue;
        deeper.insert(to);
        walked[edge->key()] = edge;
      }
    }
    level = std::move(deeper);
  }
  for (const auto& [key, edge] : map.edges) {
    const bool is_between = reached.contains(key.source) && reached.contains(key.target) &&
                            Holds(edge.valid, question.at_ns);
    if (question.tree_only ? walked.contains(key) : is_between) {
      answer.words.push_back(TextOf(edge));
    }
  }
  return answer;
}

v1::GetSubgraphRequest SubgraphRequestOf(const SubgraphQuestion& question) {
  v1::GetSubgraphRequest request;
  request.set_map(QuestionWorld::kMap);
  request.set_root(ToString(question.root));
  request.mutable_relations()->Assign(question.relations.begin(), question.relations.end());
  request.set_both_directions(question.both_directions);
  request.set_depth_max(question.depth_max);
  request.mutable_filter()->set_kind(question.kind);
  if (question.at_ns.has_value()) request.mutable_filter()->set_at_ns(*question.at_ns);
  if (question.box_map.has_value()) {
    SetPoint(question.box_map->min(), request.mutable_filter()->mutable_box()->mutable_min());
    SetPoint(question.box_map->max(), request.mutable_filter()->mutable_box()->mutable_max());
  }
  request.set_tree_only(question.tree_only);
  return request;
}

Question MakeSubgraph(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  SubgraphQuestion question;
  question.root = AnyNode(map, random);
  question.relations = AnyRelations(map, random);
  question.both_directions = random->Chance(0.4);
  question.depth_max = random->Integer(0, 4);
  if (random->Chance(0.15)) question.kind = random->Chance(0.5) ? "place" : "object";
  if (random->Chance(0.4)) question.at_ns = AnyTime(map, random);
  if (random->Chance(0.2)) {
    const Eigen::Vector3d low = AnyPoint(map, random);
    question.box_map = Box3d(low, low + Eigen::Vector3d::Constant(random->Integer(1, 8)));
  }
  question.tree_only = random->Chance(0.3);
  const v1::GetSubgraphRequest request = SubgraphRequestOf(question);
  if (question.relations.empty()) question.relations = {relations::kContains};
  Question made;
  made.text = request.ShortDebugString();
  if (question.at_ns.has_value()) made.tolerance = world.is_lossless() ? 1e-9 : 3e-4;
  made.scan = [&map, question] { return ScanSubgraph(map, question); };
  made.ask = [request, revision](Asker* asker) {
    v1::GetSubgraphRequest asked = request;
    *asked.mutable_read_at() = asker->ReadAt(revision);
    ComparedAnswer answer;
    const absl::Status status =
        query::ReadStream(asker->call, asker->core()->GetSubgraph(asker->call, asked),
                          [&](const v1::GetSubgraphResponse& part) {
                            for (const v1::Node& node : part.nodes())
                              AddNode(node, request.filter().has_at_ns(), &answer);
                            for (const v1::Edge& edge : part.edges())
                              answer.words.push_back(TextOf(edge));
                            return true;
                          });
    return status.ok() ? answer : ErrorAnswer(status);
  };
  return made;
}

}  // namespace

std::vector<QuestionKind> EdgeQuestions() {
  return {{"neighbors", MakeNeighbors}, {"list edges", MakeListEdges}, {"subgraph", MakeSubgraph}};
}

}  // namespace dsg::test
