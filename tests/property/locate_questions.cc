// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "tests/property/question.h"

namespace dsg::test {
namespace {

// What the quantized codec promises of poses, metres and radians, and what is lost in between.
constexpr double kPoseTolerance = 2.5e-4;
constexpr double kExactTolerance = 1e-9;

struct Instant {
  std::string agent;
  TimeNs at_ns = 0;
};

Instant AnyInstant(const NaiveMap& map, Random* random) {
  Instant instant;
  const int person = random->Index(RandomWorld::kPeople);
  instant.agent = random->Chance(0.3) ? "person" + std::to_string(person)
                                      : ToString(RandomWorld::Person(person));
  if (random->Chance(0.03)) instant.agent = random->Chance(0.5) ? "H77" : "R1";
  instant.at_ns = AnyTime(map, random);
  return instant;
}

NodeId AgentOf(const std::string& text) {
  for (int i = 0; i < RandomWorld::kPeople; ++i) {
    const NodeId id = RandomWorld::Person(i);
    if (text == ToString(id) || text == "person" + std::to_string(i)) return id;
  }
  return NodeId();
}

void AddPose(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation,
             ComparedAnswer* answer) {
  const Eigen::Matrix3d rotation = orientation.toRotationMatrix();
  answer->numbers.insert(answer->numbers.end(), position.data(), position.data() + 3);
  answer->numbers.insert(answer->numbers.end(), rotation.data(), rotation.data() + 9);
}

template <typename Reply>
void AddReply(const Reply& reply, ComparedAnswer* answer) {
  answer->words.insert(answer->words.end(), {reply.agent_id(), std::to_string(reply.quality()),
                                             reply.place_id(), reply.room_id()});
  if (!reply.has_pose()) return;
  const v1::Vector3& position = reply.pose().position();
  const v1::Quaternion& q = reply.pose().orientation();
  AddPose({position.x(), position.y(), position.z()},
          Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()), answer);
}

/// An agent's place at an instant by scan, or the code of the error.
absl::StatusCode ScanInstant(const NaiveMap& map, const Instant& instant, ComparedAnswer* answer) {
  const NodeId agent = AgentOf(instant.agent);
  if (agent.empty()) return absl::StatusCode::kNotFound;
  const auto at = LocateNaively(map, agent, instant.at_ns);
  if (!at.has_value()) return absl::StatusCode::kOutOfRange;
  Stay here;
  for (const auto& [key, stay] : map.stays) {
    if (stay.agent != agent || stay.enter_ns > instant.at_ns) continue;
    if (instant.at_ns < ExitOf(map, stay)) here = stay;
  }
  answer->words.insert(answer->words.end(), {ToString(agent), std::to_string(at->quality),
                                             ToString(here.place), ToString(here.room)});
  if (at->quality != v1::IN_GAP) {
    AddPose(at->map_T_agent.position, at->map_T_agent.orientation, answer);
  }
  return absl::StatusCode::kOk;
}

Question MakeLocate(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  const Instant instant = AnyInstant(map, random);
  Question made;
  made.text = instant.agent + " at " + std::to_string(instant.at_ns);
  made.tolerance = world.is_lossless() ? kExactTolerance : kPoseTolerance;
  made.scan = [&map, instant] {
    ComparedAnswer answer;
    const absl::StatusCode code = ScanInstant(map, instant, &answer);
    if (code != absl::StatusCode::kOk) return ErrorAnswer(code);
    const auto at = LocateNaively(map, AgentOf(instant.agent), instant.at_ns);
    answer.words.push_back(std::to_string(at->before_ns));
    answer.words.push_back(std::to_string(at->after_ns));
    return answer;
  };
  made.ask = [instant, revision](Asker* asker) {
    v1::LocateAgentRequest request;
    request.set_map(QuestionWorld::kMap);
    *request.mutable_read_at() = asker->ReadAt(revision);
    request.set_agent(instant.agent);
    request.set_at_ns(instant.at_ns);
    v1::LocateAgentResponse reply;
    const absl::Status status = asker->core()->LocateAgent(asker->call, request, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    ComparedAnswer answer;
    AddReply(reply, &answer);
    answer.words.push_back(std::to_string(reply.before_ns()));
    answer.words.push_back(std::to_string(reply.after_ns()));
    return answer;
  };
  return made;
}

Question MakeBatchLocate(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  std::vector<Instant> instants;
  for (int i = random->Integer(0, 8); i > 0; --i) instants.push_back(AnyInstant(map, random));
  Question made;
  made.text = std::to_string(instants.size()) + " instants";
  made.tolerance = world.is_lossless() ? kExactTolerance : kPoseTolerance;
  made.scan = [&map, instants] {
    ComparedAnswer answer;
    for (const Instant& instant : instants) {
      ComparedAnswer one;
      const absl::StatusCode code = ScanInstant(map, instant, &one);
      answer.words.push_back(std::to_string(static_cast<int>(code)));
      answer.words.insert(answer.words.end(), one.words.begin(), one.words.end());
      answer.numbers.insert(answer.numbers.end(), one.numbers.begin(), one.numbers.end());
    }
    return answer;
  };
  made.ask = [instants, revision](Asker* asker) {
    v1::BatchLocateAgentsRequest request;
    request.set_map(QuestionWorld::kMap);
    *request.mutable_read_at() = asker->ReadAt(revision);
    for (const Instant& instant : instants) {
      v1::AgentInstant* asked = request.add_instants();
      asked->set_agent(instant.agent);
      asked->set_at_ns(instant.at_ns);
    }
    v1::BatchLocateAgentsResponse reply;
    const absl::Status status = asker->core()->BatchLocateAgents(asker->call, request, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    ComparedAnswer answer;
    for (const v1::LocateResult& result : reply.results()) {
      answer.words.push_back(std::to_string(result.status_code()));
      if (result.status_code() == 0) AddReply(result, &answer);
    }
    return answer;
  };
  return made;
}

}  // namespace

std::vector<QuestionKind> LocateQuestions() {
  return {{"locate", MakeLocate}, {"batch locate", MakeBatchLocate}};
}

}  // namespace dsg::test
