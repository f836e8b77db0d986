// SPDX-License-Identifier: Apache-2.0
// A random question, asked of the engine and answered by a scan, in a form that can be compared.
// Refuses to judge: that is the test's business.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "tests/property/question_world.h"

namespace dsg::test {

/// What must be equal, and what may differ by a tolerance.
struct ComparedAnswer {
  std::vector<std::string> words;
  std::vector<double> numbers;
};

/// Who asks: a world, and how much at a time.
struct Asker {
  const QuestionWorld* world = nullptr;
  int page_size = 0;
  query::CallContext call = query::CallContext();

  query::ServiceCore* core() const { return world->core(); }
  v1::ReadAt ReadAt(Revision revision) const;
};

struct Question {
  std::string text;
  /// Numbers may differ by this much,
  double tolerance = 0.0;
  /// and be larger by this share.
  double stretch = 0.0;
  std::function<ComparedAnswer(Asker*)> ask;
  std::function<ComparedAnswer()> scan;
};

struct QuestionKind {
  const char* name;
  Question (*make)(const QuestionWorld& world, Random* random);
  /// Only maps that keep poses exactly have an exact answer.
  bool needs_lossless = false;
};

std::vector<QuestionKind> NodeQuestions();
std::vector<QuestionKind> EdgeQuestions();
std::vector<QuestionKind> LocateQuestions();
std::vector<QuestionKind> PresenceQuestions();
std::vector<QuestionKind> CollisionQuestions();
std::vector<QuestionKind> PathQuestions();
std::vector<QuestionKind> DiffQuestions();
std::vector<QuestionKind> SearchQuestions();

/// The words of an answer that is an error.
ComparedAnswer ErrorAnswer(const absl::Status& status);
ComparedAnswer ErrorAnswer(absl::StatusCode code);

/// All but the revision that wrote it.
std::string TextOf(const Node& node);
std::string TextOf(v1::Node node);
std::string TextOf(const Edge& edge);
std::string TextOf(v1::Edge edge);

NodeId AnyNode(const NaiveMap& map, Random* random);
/// Of any scale that something in the world changes at.
TimeNs AnyTime(const NaiveMap& map, Random* random);
Eigen::Vector3d AnyPoint(const NaiveMap& map, Random* random);
void SetPoint(const Eigen::Vector3d& point, v1::Vector3* out);

/// Sources of CONTAINS edges, ascending.
std::vector<NodeId> ParentsOf(const NaiveMap& map, NodeId id);
std::vector<NodeId> ChildrenOf(const NaiveMap& map, NodeId id);
/// However far below.
std::vector<NodeId> AllBelow(const NaiveMap& map, NodeId id);
bool Holds(const Interval& valid, const std::optional<TimeNs>& at_ns);

/// The end of a stay; of an open one 1 ns after the agent's last pose.
TimeNs ExitOf(const NaiveMap& map, const Stay& stay);

/// Where an agent was, by the poses around an instant.
struct NaiveLocation {
  v1::PoseQuality quality = v1::EXACT;
  Pose3d map_T_agent;
  TimeNs before_ns = 0;
  TimeNs after_ns = 0;
};
/// nullopt outside the track.
std::optional<NaiveLocation> LocateNaively(const NaiveMap& map, NodeId agent, TimeNs at_ns);

/// A node of an answer about an instant, if one is given: agents are where their tracks put them.
struct NodeThen {
  Node node;
  bool is_there = true;
  /// False outside the track and in its gaps.
  bool has_pose = true;
};
NodeThen NodeAt(const NaiveMap& map, const Node& node, std::optional<TimeNs> at_ns);

/// Adds a node of an answer. Where an agent was at an instant is not stored to the last digit.
void AddNode(v1::Node node, bool is_of_instant, ComparedAnswer* answer);
void AddNode(const NodeThen& then, bool is_of_instant, ComparedAnswer* answer);

/// All pages as one answer.
template <typename Request, typename Response>
ComparedAnswer AllPages(Asker* asker, Revision revision, Request request,
                        absl::Status (query::Api::*method)(const query::CallContext&,
                                                           const Request&, Response*),
                        const std::function<void(const Response&, ComparedAnswer*)>& take) {
  ComparedAnswer answer;
  request.set_map(QuestionWorld::kMap);
  *request.mutable_read_at() = asker->ReadAt(revision);
  request.set_page_size(asker->page_size);
  do {
    Response page;
    const absl::Status status = (asker->core()->*method)(asker->call, request, &page);
    if (!status.ok()) return ErrorAnswer(status);
    take(page, &answer);
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return answer;
}

}  // namespace dsg::test
