// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "schema/codec/proto_convert.h"
#include "tests/property/question.h"

namespace dsg::test {
namespace {

/// What a v1.NodeFilter says.
struct Wanted {
  std::string layer;
  std::string kind;
  std::string class_name;
  std::string name;
  NodeId parent;
  std::optional<Box3d> box_map;
  std::optional<TimeNs> at_ns;

  bool Holds(const NaiveMap& map, const Node& node) const {
    if (!layer.empty() && LayerTable().Find(node.layer)->name != layer) return false;
    if (!kind.empty() && node.kind != kind) return false;
    if (!class_name.empty() && node.class_name != class_name) return false;
    if (!name.empty() && node.name != name) return false;
    if (!test::Holds(node.valid, at_ns)) return false;
    if (box_map.has_value() && !node.BoxMap().intersects(*box_map)) return false;
    return parent.empty() || map.edges.contains({parent, relations::kContains, node.id});
  }

  v1::NodeFilter ToProto() const {
    v1::NodeFilter out;
    out.set_layer(layer);
    out.set_kind(kind);
    out.set_class_name(class_name);
    out.set_name(name);
    out.set_parent_id(ToString(parent));
    if (box_map.has_value()) dsg::ToProto(*box_map, out.mutable_box());
    if (at_ns.has_value()) out.set_at_ns(*at_ns);
    return out;
  }
};

// The things that all questions with a filter have.
Wanted AnyFilter(const NaiveMap& map, Random* random) {
  static constexpr const char* kLayers[] = {"objects", "objects", "places",    "places",
                                            "rooms",   "agents",  "buildings", "structures"};
  static constexpr const char* kKinds[] = {"object", "place", "room",
                                           "human",  "robot", "structure"};
  static constexpr const char* kClassNames[] = {"cup", "chair", "table", "sofa"};
  Wanted wanted;
  if (random->Chance(0.4)) wanted.layer = kLayers[random->Index(8)];
  if (random->Chance(0.2)) wanted.kind = kKinds[random->Index(6)];
  if (random->Chance(0.2)) wanted.class_name = kClassNames[random->Index(4)];
  if (random->Chance(0.4)) wanted.at_ns = AnyTime(map, random);
  return wanted;
}

void AddBox(const NaiveMap& map, Random* random, Wanted* wanted) {
  const Eigen::Vector3d low = AnyPoint(map, random);
  const double size_m = random->Chance(0.5) ? random->Integer(0, 6) : random->Uniform(0, 30);
  wanted->box_map = Box3d(low, low + Eigen::Vector3d::Constant(size_m));
}

struct Near {
  double distance_m = 0.0;
  NodeId id;
  auto operator<=>(const Near&) const = default;
};

struct NearestQuestion {
  Wanted wanted;
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  int k = 1;
  double distance_m_max = 0.0;

  bool AsksForAgents() const {
    return wanted.layer == "agents" || wanted.kind == "human" || wanted.kind == "robot";
  }
};

ComparedAnswer ScanNearest(const NaiveMap& map, const NearestQuestion& question) {
  if (question.AsksForAgents() && !question.wanted.at_ns.has_value()) {
    return ErrorAnswer(absl::StatusCode::kInvalidArgument);
  }
  std::vector<Near> found;
  for (const auto& [id, stored] : map.nodes) {
    if (stored.layer == layers::kAgents && !question.wanted.at_ns.has_value()) continue;
    const auto [node, is_there, has_pose] = NodeAt(map, stored, question.wanted.at_ns);
    if (!is_there || !has_pose) continue;
    if (!question.wanted.Holds(map, node)) continue;
    const double distance_m = node.DistanceTo(question.point_map);
    if (question.distance_m_max > 0.0 && distance_m > question.distance_m_max) continue;
    found.push_back({distance_m, id});
  }
  std::sort(found.begin(), found.end());
  ComparedAnswer answer;
  for (const Near& near : found) {
    if (answer.words.size() == static_cast<size_t>(question.k)) break;
    answer.words.push_back(ToString(near.id));
    answer.numbers.push_back(near.distance_m);
  }
  return answer;
}

Question MakeNearest(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  NearestQuestion question;
  question.wanted = AnyFilter(map, random);
  question.point_map = AnyPoint(map, random);
  question.k = random->Chance(0.1) ? 1000 : random->Integer(1, 12);
  if (random->Chance(0.4)) question.distance_m_max = random->Integer(1, 20) / 2.0;
  v1::ListNearestNodesRequest request;
  request.set_map(QuestionWorld::kMap);
  SetPoint(question.point_map, request.mutable_position());
  request.set_k(question.k);
  request.set_max_distance_m(question.distance_m_max);
  *request.mutable_filter() = question.wanted.ToProto();
  request.set_view(v1::NODE_VIEW_BASIC);
  Question made;
  made.text = request.ShortDebugString();
  // Poses are not stored to the last digit, nodes are.
  if (question.wanted.at_ns.has_value()) made.tolerance = world.is_lossless() ? 1e-9 : 3e-4;
  made.scan = [&map, question] { return ScanNearest(map, question); };
  made.ask = [request, revision](Asker* asker) {
    v1::ListNearestNodesRequest asked = request;
    *asked.mutable_read_at() = asker->ReadAt(revision);
    v1::ListNearestNodesResponse reply;
    const absl::Status status = asker->core()->ListNearestNodes(asker->call, asked, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    ComparedAnswer answer;
    for (const v1::NearestNode& near : reply.nodes()) {
      answer.words.push_back(near.node().id());
      answer.numbers.push_back(near.distance_m());
    }
    return answer;
  };
  return made;
}

ComparedAnswer ScanNodes(const NaiveMap& map, const Wanted& wanted) {
  ComparedAnswer answer;
  for (const auto& [id, stored] : map.nodes) {
    const NodeThen then = NodeAt(map, stored, wanted.at_ns);
    if (!then.is_there || (!then.has_pose && wanted.box_map.has_value())) continue;
    if (wanted.Holds(map, then.node)) AddNode(then, wanted.at_ns.has_value(), &answer);
  }
  return answer;
}

Question MakeListNodes(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  Wanted wanted = AnyFilter(map, random);
  if (random->Chance(0.4)) AddBox(map, random, &wanted);
  if (random->Chance(0.3)) wanted.parent = NodeId('R', static_cast<uint64_t>(random->Index(4)));
  if (random->Chance(0.2)) wanted.name = "thing" + std::to_string(random->Index(20));
  v1::ListNodesRequest request;
  *request.mutable_filter() = wanted.ToProto();
  Question made;
  made.text = request.ShortDebugString();
  const bool is_of_instant = wanted.at_ns.has_value();
  if (is_of_instant) made.tolerance = world.is_lossless() ? 1e-9 : 3e-4;
  made.scan = [&map, wanted] { return ScanNodes(map, wanted); };
  made.ask = [request, revision, is_of_instant](Asker* asker) {
    return AllPages<v1::ListNodesRequest, v1::ListNodesResponse>(
        asker, revision, request, &query::Api::ListNodes,
        [is_of_instant](const v1::ListNodesResponse& page, ComparedAnswer* answer) {
          for (const v1::Node& node : page.nodes()) AddNode(node, is_of_instant, answer);
        });
  };
  return made;
}

// A node's id, or a name, or nothing that there is.
std::string AnyIdOrName(const NaiveMap& map, Random* random) {
  const double what = random->Uniform();
  if (what < 0.6) return ToString(AnyNode(map, random));
  if (what < 0.7) return "O" + std::to_string(random->Integer(1, 90));
  if (what < 0.9) return "thing" + std::to_string(random->Index(20));
  return what < 0.95 ? "room" + std::to_string(random->Index(5)) : "nobody";
}

struct Resolved {
  absl::StatusCode code = absl::StatusCode::kOk;
  NodeId id;
};

Resolved Resolve(const NaiveMap& map, const std::string& text) {
  std::vector<NodeId> named;
  for (const auto& [id, node] : map.nodes) {
    if (ToString(id) == text) return {absl::StatusCode::kOk, id};
    if (node.name == text) named.push_back(id);
  }
  if (named.empty()) return {absl::StatusCode::kNotFound, NodeId()};
  if (named.size() > 1) return {absl::StatusCode::kInvalidArgument, NodeId()};
  return {absl::StatusCode::kOk, named.front()};
}

ComparedAnswer ScanGetNode(const NaiveMap& map, const std::string& text) {
  const Resolved resolved = Resolve(map, text);
  if (resolved.code != absl::StatusCode::kOk) return ErrorAnswer(resolved.code);
  ComparedAnswer answer{{TextOf(map.nodes.at(resolved.id))}, {}};
  for (auto parents = ParentsOf(map, resolved.id); !parents.empty();
       parents = ParentsOf(map, parents.front())) {
    answer.words.push_back(ToString(parents.front()));
  }
  const auto track = map.tracks.find(resolved.id);
  const bool has_track = track != map.tracks.end() && !track->second.empty();
  answer.words.push_back(std::to_string(ChildrenOf(map, resolved.id).size()));
  answer.words.push_back(std::to_string(has_track ? track->second.size() : 0));
  answer.words.push_back(std::to_string(has_track ? track->second.begin()->first : 0));
  answer.words.push_back(std::to_string(has_track ? track->second.rbegin()->first : 0));
  return answer;
}

Question MakeGetNode(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  const std::string text = AnyIdOrName(map, random);
  Question made;
  made.text = text;
  made.scan = [&map, text] { return ScanGetNode(map, text); };
  made.ask = [text, revision](Asker* asker) {
    v1::GetNodeRequest request;
    request.set_map(QuestionWorld::kMap);
    request.set_id(text);
    *request.mutable_read_at() = asker->ReadAt(revision);
    v1::GetNodeResponse reply;
    const absl::Status status = asker->core()->GetNode(asker->call, request, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    ComparedAnswer answer{{TextOf(reply.node())}, {}};
    answer.words.insert(answer.words.end(), reply.ancestor_ids().begin(),
                        reply.ancestor_ids().end());
    for (const int64_t number :
         {reply.child_count(), reply.pose_count(), reply.first_pose_ns(), reply.last_pose_ns()}) {
      answer.words.push_back(std::to_string(number));
    }
    return answer;
  };
  return made;
}

Question MakeBatchGet(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  v1::BatchGetNodesRequest request;
  request.set_map(QuestionWorld::kMap);
  for (int i = random->Integer(0, 8); i > 0; --i) request.add_ids(AnyIdOrName(map, random));
  Question made;
  made.text = request.ShortDebugString();
  made.scan = [&map, request] {
    ComparedAnswer answer;
    for (const std::string& text : request.ids()) {
      const Resolved resolved = Resolve(map, text);
      answer.words.push_back(std::to_string(static_cast<int>(resolved.code)));
      if (resolved.code == absl::StatusCode::kOk) {
        answer.words.push_back(TextOf(map.nodes.at(resolved.id)));
      }
    }
    return answer;
  };
  made.ask = [request, revision](Asker* asker) {
    v1::BatchGetNodesRequest asked = request;
    *asked.mutable_read_at() = asker->ReadAt(revision);
    v1::BatchGetNodesResponse reply;
    const absl::Status status = asker->core()->BatchGetNodes(asker->call, asked, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    ComparedAnswer answer;
    for (const v1::GetNodeResult& result : reply.results()) {
      answer.words.push_back(std::to_string(result.status_code()));
      if (result.has_node()) answer.words.push_back(TextOf(result.node()));
    }
    return answer;
  };
  return made;
}

}  // namespace

std::vector<QuestionKind> NodeQuestions() {
  return {{"nearest", MakeNearest},
          {"list nodes", MakeListNodes},
          {"get node", MakeGetNode},
          {"batch get nodes", MakeBatchGet}};
}

}  // namespace dsg::test
