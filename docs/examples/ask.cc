// SPDX-License-Identifier: Apache-2.0
// An example of the C++ client: connects to a dsg-server and runs four queries about one agent.
//
//   ask ADDRESS MAP AGENT SECONDS        e.g. ask unix:dsg.sock office carol 30
//
// Link dsg::client and dsg::proto. Every call takes a CallContext (its deadline, and a way to
// cancel it), retries while the server cannot be reached, and returns the errors of the server. Use
// the batch calls instead of loops: one round trip instead of many.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "dsg/v1/query_service.pb.h"
#include "query/client/remote_api.h"

namespace {

using dsg::query::Api;
using dsg::query::CallContext;
namespace v1 = dsg::v1;

constexpr int64_t kNsPerSecond = 1'000'000'000;

// Each call has its own deadline; this one bounds the server's work too.
CallContext WithinFiveSeconds() {
  return CallContext(CallContext::Clock::now() + std::chrono::seconds(5));
}

// The agent's pose every second for ten seconds, in one call.
absl::Status AskWhere(Api* api, const std::string& map, const std::string& agent, int64_t at_ns) {
  v1::BatchLocateAgentsRequest request;
  request.set_map(map);
  for (int second = 0; second < 10; ++second) {
    v1::AgentInstant* instant = request.add_instants();
    instant->set_agent(agent);
    instant->set_at_ns(at_ns + second * kNsPerSecond);
  }
  v1::BatchLocateAgentsResponse reply;
  const absl::Status status = api->BatchLocateAgents(WithinFiveSeconds(), request, &reply);
  if (!status.ok()) return status;
  for (const v1::LocateResult& result : reply.results()) {
    if (result.status_code() != 0) {
      std::cout << "where: " << result.status_message() << "\n";
      continue;
    }
    std::cout << "where: " << result.agent_id() << " in " << result.room_id() << " at "
              << result.pose().position().x() << " " << result.pose().position().y() << "\n";
  }
  return absl::OkStatus();
}

// The query language of docs/search.md, nearest first from the origin.
absl::Status AskFind(Api* api, const std::string& map) {
  v1::SearchNodesRequest request;
  request.set_map(map);
  request.set_query("chair");
  request.mutable_near();
  request.set_page_size(3);
  v1::SearchNodesResponse reply;
  const absl::Status status = api->SearchNodes(WithinFiveSeconds(), request, &reply);
  if (!status.ok()) return status;
  for (const v1::SearchHit& hit : reply.hits()) {
    std::cout << "find: " << hit.node().id() << " " << hit.node().name() << ", " << hit.distance_m()
              << " m\n";
  }
  return absl::OkStatus();
}

// The path from the agent's position to the nearest chair.
absl::Status AskPath(Api* api, const std::string& map, const std::string& agent, int64_t at_ns) {
  v1::PlanPathRequest request;
  request.set_map(map);
  request.mutable_from()->set_node(agent);
  request.mutable_to()->mutable_nearest()->set_class_name("chair");
  request.set_at_ns(at_ns);
  v1::PlanPathResponse reply;
  const absl::Status status = api->PlanPath(WithinFiveSeconds(), request, &reply);
  if (!status.ok()) return status;
  std::cout << "path: " << reply.length_m() << " m to " << reply.to_node_id() << " over "
            << reply.place_ids_size() << " places\n";
  return absl::OkStatus();
}

absl::Status AskPredict(Api* api, const std::string& map, const std::string& agent,
                        int64_t from_ns) {
  v1::PredictAgentRequest request;
  request.set_map(map);
  request.set_agent(agent);
  request.set_from_ns(from_ns);
  v1::PredictAgentResponse reply;
  const absl::Status status = api->PredictAgent(WithinFiveSeconds(), request, &reply);
  if (!status.ok()) return status;
  for (const v1::PredictedPath& path : reply.paths()) {
    std::cout << "predict: probability " << path.probability() << ", " << path.poses_size()
              << " steps\n";
  }
  return absl::OkStatus();
}

absl::Status AskAll(const std::string& address, const std::string& map, const std::string& agent,
                    int64_t at_ns) {
  // No round trip yet: the first call connects. One Api serves any number of threads.
  absl::StatusOr<std::unique_ptr<Api>> api = dsg::client::Connect(address);
  if (!api.ok()) return api.status();
  if (auto status = AskWhere(api->get(), map, agent, at_ns); !status.ok()) return status;
  if (auto status = AskFind(api->get(), map); !status.ok()) return status;
  if (auto status = AskPath(api->get(), map, agent, at_ns); !status.ok()) return status;
  return AskPredict(api->get(), map, agent, at_ns);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::cerr << "usage: ask ADDRESS MAP AGENT SECONDS\n";
    return 2;
  }
  const auto at_ns = static_cast<int64_t>(std::atof(argv[4]) * static_cast<double>(kNsPerSecond));
  const absl::Status status = AskAll(argv[1], argv[2], argv[3], at_ns);
  if (!status.ok()) std::cerr << "ask: " << status << "\n";
  return status.ok() ? 0 : 1;
}
