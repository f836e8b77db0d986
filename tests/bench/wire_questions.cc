// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_questions.h"

#include <functional>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "tests/bench/w2_graph.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

using query::Api;
using QueryStub = v1::QueryService::Stub;
using MapStub = v1::MapService::Stub;

template <typename Stub, typename Request, typename Reply>
class TypedQuestion final : public Question {
 public:
  using Ask = absl::Status (Api::*)(const query::CallContext&, const Request&, Reply*);
  using Rpc = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Reply*);
  using Drawer = std::function<void(Random*, Request*)>;

  TypedQuestion(std::string name, Ask ask, Rpc rpc, Drawer drawer)
      : Question(std::move(name)), ask_(ask), rpc_(rpc), drawer_(std::move(drawer)) {}

  void Draw(Random* random) override {
    request_.Clear();
    if constexpr (requires { request_.set_map(kWireMap); }) request_.set_map(kWireMap);
    drawer_(random, &request_);
  }

  // A reply of its own for each call, as the server has it.
  absl::Status AskEngine(Api* engine) override {
    Reply reply;
    const absl::Status status = (engine->*ask_)(query::CallContext(), request_, &reply);
    engine_bytes_ = reply.ByteSizeLong();
    return status;
  }

  absl::Status AskServer(const WireClient& client) override {
    Reply reply;
    grpc::Status status;
    if constexpr (std::is_same_v<Stub, QueryStub>) {
      status = Call(client.query.get(), rpc_, request_, &reply);
    } else {
      status = Call(client.map.get(), rpc_, request_, &reply);
    }
    server_bytes_ = reply.ByteSizeLong();
    return FromGrpc(status);
  }

  size_t engine_bytes() const override { return engine_bytes_; }
  size_t server_bytes() const override { return server_bytes_; }

 private:
  const Ask ask_;
  const Rpc rpc_;
  const Drawer drawer_;
  Request request_;
  size_t engine_bytes_ = 0;
  size_t server_bytes_ = 0;
};

template <typename Stub, typename Request, typename Reply, typename Drawer>
std::unique_ptr<Question> Make(
    std::string name, absl::Status (Api::*ask)(const query::CallContext&, const Request&, Reply*),
    grpc::Status (Stub::*rpc)(grpc::ClientContext*, const Request&, Reply*), Drawer drawer) {
  return std::make_unique<TypedQuestion<Stub, Request, Reply>>(std::move(name), ask, rpc,
                                                               std::move(drawer));
}

std::string RandomPerson(Random* random) {
  return ToString(WirePerson(random->Index(kWirePersonCount)));
}

// Not an end of a track.
TimeNs RandomTime(Random* random) {
  return static_cast<TimeNs>(random->Uniform(0.02, 0.98) * static_cast<double>(kWireEndNs));
}

std::string RandomNode(Random* random) {
  if (random->Chance(0.5)) return absl::StrCat("O", 100 + random->Index(kW2ObjectCount - 100));
  return absl::StrCat("p", random->Index(kW2PlaceCount));
}

void DrawPosition(Random* random, v1::Vector3* out) {
  out->set_x(random->Uniform(1, 48));
  out->set_y(random->Uniform(1, 48));
  out->set_z(random->Uniform(0.5, 4));
}

void DrawBodies(Random* random, v1::CheckCollisionRequest* request) {
  v1::CollisionBody* body = request->add_bodies();
  body->mutable_capsule()->set_radius_m(0.25);
  body->mutable_capsule()->set_length_m(1.0);
  DrawPosition(random, body->add_poses()->mutable_position());
  request->mutable_scope()->set_objects(true);
}

void DrawPath(Random* random, v1::PlanPathRequest* request) {
  DrawPosition(random, request->mutable_from()->mutable_position());
  DrawPosition(random, request->mutable_to()->mutable_position());
}

void DrawWindow(Random* random, TimeNs length_ns, TimeNs* from_ns, TimeNs* to_ns) {
  *from_ns = static_cast<TimeNs>(random->Uniform() * static_cast<double>(kWireEndNs - length_ns));
  *to_ns = *from_ns + length_ns;
}

template <typename Request>
void SetWindow(Random* random, TimeNs length_ns, Request* request) {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  DrawWindow(random, length_ns, &from_ns, &to_ns);
  request->set_from_ns(from_ns);
  request->set_to_ns(to_ns);
}

using Questions = std::vector<std::unique_ptr<Question>>;

void AddLookups(Questions* out) {
  out->push_back(Make("LocateAgent", &Api::LocateAgent, &QueryStub::LocateAgent,
                      [](Random* random, v1::LocateAgentRequest* request) {
                        request->set_agent(RandomPerson(random));
                        request->set_at_ns(RandomTime(random));
                      }));
  out->push_back(Make("BatchLocateAgents of 100", &Api::BatchLocateAgents,
                      &QueryStub::BatchLocateAgents,
                      [](Random* random, v1::BatchLocateAgentsRequest* request) {
                        for (int i = 0; i < 100; ++i) {
                          v1::AgentInstant* instant = request->add_instants();
                          instant->set_agent(RandomPerson(random));
                          instant->set_at_ns(RandomTime(random));
                        }
                      }));
  out->push_back(Make(
      "GetNode", &Api::GetNode, &QueryStub::GetNode,
      [](Random* random, v1::GetNodeRequest* request) { request->set_id(RandomNode(random)); }));
  out->push_back(Make("BatchGetNodes of 20", &Api::BatchGetNodes, &QueryStub::BatchGetNodes,
                      [](Random* random, v1::BatchGetNodesRequest* request) {
                        for (int i = 0; i < 20; ++i) request->add_ids(RandomNode(random));
                      }));
  out->push_back(Make("GetNeighbors", &Api::GetNeighbors, &QueryStub::GetNeighbors,
                      [](Random* random, v1::GetNeighborsRequest* request) {
                        request->set_id(RandomNode(random));
                        request->set_outgoing(true);
                        request->set_incoming(true);
                      }));
}

void AddLists(Questions* out) {
  out->push_back(Make("ListNodes of 50", &Api::ListNodes, &QueryStub::ListNodes,
                      [](Random* random, v1::ListNodesRequest* request) {
                        request->mutable_filter()->set_parent_id(
                            absl::StrCat("R", random->Index(100)));
                        request->set_page_size(50);
                      }));
  out->push_back(Make("ListEdges", &Api::ListEdges, &QueryStub::ListEdges,
                      [](Random* random, v1::ListEdgesRequest* request) {
                        request->set_source(absl::StrCat("p", random->Index(kW2PlaceCount)));
                      }));
  out->push_back(Make("ListNearestNodes, k = 5", &Api::ListNearestNodes,
                      &QueryStub::ListNearestNodes,
                      [](Random* random, v1::ListNearestNodesRequest* request) {
                        DrawPosition(random, request->mutable_position());
                        request->mutable_filter()->set_layer("objects");
                        request->set_k(5);
                      }));
  out->push_back(Make("SearchNodes, 10 nearest", &Api::SearchNodes, &QueryStub::SearchNodes,
                      [](Random* random, v1::SearchNodesRequest* request) {
                        request->mutable_pattern()->set_kind("object");
                        DrawPosition(random, request->mutable_near());
                        request->set_page_size(10);
                      }));
  out->push_back(Make("SearchNodes by name in a room", &Api::SearchNodes, &QueryStub::SearchNodes,
                      [](Random* random, v1::SearchNodesRequest* request) {
                        request->set_query(absl::StrCat("name = \"object_", random->Index(100),
                                                        "*\" inside R", random->Index(100)));
                        request->set_page_size(10);
                      }));
}

void AddMeetings(Questions* out) {
  out->push_back(Make("ListPresence", &Api::ListPresence, &QueryStub::ListPresence,
                      [](Random* random, v1::ListPresenceRequest* request) {
                        request->set_node_id(absl::StrCat("R", 44 + random->Index(3)));
                        SetWindow(random, 20 * kNsPerSecond, request);
                      }));
  out->push_back(Make("ListEncounters", &Api::ListEncounters, &QueryStub::ListEncounters,
                      [](Random* random, v1::ListEncountersRequest* request) {
                        request->set_agent(RandomPerson(random));
                        SetWindow(random, 20 * kNsPerSecond, request);
                      }));
  out->push_back(Make("ListInteractions", &Api::ListInteractions, &QueryStub::ListInteractions,
                      [](Random* random, v1::ListInteractionsRequest* request) {
                        request->set_object(absl::StrCat("O", random->Index(kWireTakenCount)));
                        request->set_to_ns(kWireEndNs);
                        request->set_include_abstained(true);
                      }));
}

void AddSpace(Questions* out) {
  out->push_back(
      Make("PlanPath", &Api::PlanPath, &QueryStub::PlanPath,
           [](Random* random, v1::PlanPathRequest* request) { DrawPath(random, request); }));
  out->push_back(Make("PlanPaths of 10", &Api::PlanPaths, &QueryStub::PlanPaths,
                      [](Random* random, v1::PlanPathsRequest* request) {
                        for (int i = 0; i < 10; ++i) DrawPath(random, request->add_paths());
                      }));
  out->push_back(
      Make("CheckCollision", &Api::CheckCollision, &QueryStub::CheckCollision, DrawBodies));
  out->push_back(Make("CheckCollision of 100", &Api::CheckCollision, &QueryStub::CheckCollision,
                      [](Random* random, v1::CheckCollisionRequest* request) {
                        for (int i = 0; i < 100; ++i) DrawBodies(random, request);
                      }));
  out->push_back(Make("PredictAgent", &Api::PredictAgent, &QueryStub::PredictAgent,
                      [](Random* random, v1::PredictAgentRequest* request) {
                        request->set_agent(RandomPerson(random));
                        request->set_from_ns(RandomTime(random));
                      }));
  out->push_back(Make("PredictAgent, constant velocity", &Api::PredictAgent,
                      &QueryStub::PredictAgent,
                      [](Random* random, v1::PredictAgentRequest* request) {
                        request->set_agent(RandomPerson(random));
                        request->set_from_ns(RandomTime(random));
                        request->set_model(v1::CONSTANT_VELOCITY);
                      }));
}

void AddMaps(Questions* out) {
  out->push_back(Make("DiffRevisions of 50", &Api::DiffRevisions, &MapStub::DiffRevisions,
                      [](Random*, v1::DiffRevisionsRequest* request) {
                        request->set_from_revision(1);
                        request->set_to_revision(2);
                        request->set_page_size(50);
                      }));
  out->push_back(Make("GetMapStats", &Api::GetMapStats, &MapStub::GetMapStats,
                      [](Random*, v1::GetMapStatsRequest*) {}));
  out->push_back(Make("ListRevisions", &Api::ListRevisions, &MapStub::ListRevisions,
                      [](Random*, v1::ListRevisionsRequest*) {}));
  out->push_back(
      Make("ListMaps", &Api::ListMaps, &MapStub::ListMaps, [](Random*, v1::ListMapsRequest*) {}));
}

}  // namespace

std::vector<std::unique_ptr<Question>> QuestionsWanted(const QuestionFilter& filter) {
  Questions questions;
  AddLookups(&questions);
  AddLists(&questions);
  AddMeetings(&questions);
  AddSpace(&questions);
  AddMaps(&questions);
  std::erase_if(questions, [&](const auto& question) {
    const std::string& name = question->name();
    return name.find(filter.only) == std::string::npos ||
           (!filter.except.empty() && name.find(filter.except) != std::string::npos);
  });
  return questions;
}

}  // namespace dsg::bench
