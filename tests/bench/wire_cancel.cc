// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_cancel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/bench/w2_graph.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 6;
constexpr double kMostMs = 50.0;
// Longer questions are not waited for.
constexpr std::chrono::seconds kWholeMax{4};
// Cancels fall into the first so much of a question's work.
constexpr int64_t kStretchNs = 600'000'000;

// Asks until it is answered or cancelled.
using Ask = std::function<grpc::Status(const WireClient&, grpc::ClientContext*)>;

struct LongQuestion {
  std::string name;
  Ask ask;
  /// The graph is to be read from the disk again before each.
  bool is_cold = false;
};

template <typename Stub, typename Request, typename Reply>
Ask Unary(grpc::Status (Stub::*rpc)(grpc::ClientContext*, const Request&, Reply*),
          const Request& request) {
  return [rpc, request](const WireClient& client, grpc::ClientContext* context) {
    Reply reply;
    return (client.query.get()->*rpc)(context, request, &reply);
  };
}

template <typename Reply>
grpc::Status ReadAll(grpc::ClientReader<Reply>* reader) {
  Reply reply;
  while (reader->Read(&reply)) {
  }
  return reader->Finish();
}

void DrawPosition(Random* random, v1::Vector3* out) {
  out->set_x(random->Uniform(1, 48));
  out->set_y(random->Uniform(1, 48));
  out->set_z(random->Uniform(0.5, 4));
}

v1::PlanPathsRequest ManyPaths() {
  Random random(kSeed, 0);
  v1::PlanPathsRequest request;
  request.set_map(kWireMap);
  for (int i = 0; i < 1000; ++i) {
    v1::PlanPathRequest* path = request.add_paths();
    DrawPosition(&random, path->mutable_from()->mutable_position());
    DrawPosition(&random, path->mutable_to()->mutable_position());
    path->set_mode(v1::FLAT);
  }
  return request;
}

// Long ways through everything there is.
v1::CheckCollisionRequest ManyPoses() {
  Random random(kSeed, 1);
  v1::CheckCollisionRequest request;
  request.set_map(kWireMap);
  for (int i = 0; i < 10; ++i) {
    v1::CollisionBody* body = request.add_bodies();
    body->mutable_cuboid()->mutable_size()->set_x(1e-3);
    body->mutable_cuboid()->mutable_size()->set_y(1e-3);
    body->mutable_cuboid()->mutable_size()->set_z(1e-3);
    for (int k = 0; k < 1000; ++k) DrawPosition(&random, body->add_poses()->mutable_position());
  }
  return request;
}

v1::SearchNodesRequest SearchOfAll() {
  v1::SearchNodesRequest request;
  request.set_map(kWireMap);
  // Nothing is like that, and no index knows it.
  request.set_query(
      "name = \"*7*7*8*8*9*\" and not inside (place and not traversable (place and "
      "traversable (place and traversable R1)))");
  return request;
}

v1::ListEncountersRequest AllEncounters() {
  v1::ListEncountersRequest request;
  request.set_map(kWireMap);
  request.set_to_ns(kWireEndNs);
  request.set_distance_m(30);
  request.set_page_size(1000);
  return request;
}

v1::PredictAgentRequest LongPrediction() {
  v1::PredictAgentRequest request;
  request.set_map(kWireMap);
  request.set_agent(ToString(WirePerson(0)));
  request.set_from_ns(kWireEndNs / 2);
  request.set_horizon_ns(400 * kNsPerSecond);
  request.set_path_count_max(20);
  return request;
}

Ask WholeMesh() {
  return [](const WireClient& client, grpc::ClientContext* context) {
    v1::GetMeshRequest request;
    request.set_map(kWireMeshMap);
    return ReadAll(client.query->GetMesh(context, request).get());
  };
}

Ask WholeGraph() {
  return [](const WireClient& client, grpc::ClientContext* context) {
    v1::GetSubgraphRequest request;
    request.set_map(kWireMap);
    request.set_root("B0");
    request.set_depth_max(10);
    return ReadAll(client.query->GetSubgraph(context, request).get());
  };
}

std::vector<LongQuestion> LongQuestions() {
  using Stub = v1::QueryService::Stub;
  v1::SearchNodesRequest any;
  any.set_map(kWireMap);
  any.mutable_pattern()->set_kind("object");
  v1::PlanPathRequest path = ManyPaths().paths(0);
  path.set_map(kWireMap);
  path.set_mode(v1::HIERARCHICAL);
  return {{"reading the graph", Unary(&Stub::SearchNodes, any), true},
          {"reading the graph for a path", Unary(&Stub::PlanPath, path), true},
          {"SearchNodes over all", Unary(&Stub::SearchNodes, SearchOfAll())},
          {"PlanPaths of 1000", Unary(&Stub::PlanPaths, ManyPaths())},
          {"CheckCollision of 10,000 poses", Unary(&Stub::CheckCollision, ManyPoses())},
          {"ListEncounters of all", Unary(&Stub::ListEncounters, AllEncounters())},
          {"PredictAgent", Unary(&Stub::PredictAgent, LongPrediction())},
          {"GetMesh", WholeMesh()},
          {"GetSubgraph", WholeGraph()}};
}

class Canceller {
 public:
  explicit Canceller(WirePlace place) : place_(std::move(place)) {}

  absl::Status Measure(const LongQuestion& question, int repeat_count, Report* report) {
    DSG_RETURN_IF_ERROR(Restart());
    if (!question.is_cold) DSG_RETURN_IF_ERROR(Warm());
    grpc::Status answered;
    const int64_t whole_ns = NanosecondsOf([&] {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + kWholeMax);
      answered = question.ask(client_, &context);
    });
    if (!answered.ok() && answered.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) {
      return FromGrpc(answered);
    }
    Samples samples;
    int missed_count = 0;
    // Each cold one needs a server of its own.
    if (question.is_cold) repeat_count = (repeat_count + 1) / 2;
    for (int i = 0; i < repeat_count; ++i) {
      if (question.is_cold) DSG_RETURN_IF_ERROR(Restart());
      const double share = (i + 0.5) / repeat_count;
      const auto stretch_ns = static_cast<double>(std::min(whole_ns, kStretchNs));
      DSG_RETURN_IF_ERROR(
          CancelOnce(question, static_cast<int64_t>(share * stretch_ns), &samples, &missed_count));
    }
    report->Note(absl::StrCat(question.name, ": takes ", whole_ns / 1'000'000, " ms",
                              answered.ok() ? "" : " and more", "; ", missed_count, " of ",
                              repeat_count, " ended before they were cancelled"));
    if (samples.count() == 0) return absl::OkStatus();
    report->Line(absl::StrCat("free after a cancel of ", question.name, ", the longest"), "ms",
                 {samples.Percentile(1.0) / 1e6, {}}, {}, {Target::Kind::kAtMost, kMostMs});
    return absl::OkStatus();
  }

 private:
  absl::Status Restart() {
    server_.process = nullptr;
    DSG_ASSIGN_OR_RETURN(server_, StartWireServer(place_, {"--workers", "1"}));
    DSG_ASSIGN_OR_RETURN(client_, Connect(server_.address));
    return AskInfo();
  }

  absl::Status AskInfo() const {
    v1::GetServerInfoResponse info;
    return FromGrpc(Call(client_.map.get(), &v1::MapService::Stub::GetServerInfo,
                         v1::GetServerInfoRequest(), &info));
  }

  absl::Status Warm() const {
    v1::PlanPathRequest request = ManyPaths().paths(0);
    request.set_map(kWireMap);
    v1::PlanPathResponse reply;
    return FromGrpc(Call(client_.query.get(), &v1::QueryService::Stub::PlanPath, request, &reply));
  }

  // The empty call waits for the only worker, and is answered when that is free.
  absl::Status CancelOnce(const LongQuestion& question, int64_t after_ns, Samples* samples,
                          int* missed_count) {
    grpc::ClientContext context;
    grpc::Status answered;
    std::atomic<bool> done{false};
    std::thread asker([&] {
      answered = question.ask(client_, &context);
      done = true;
    });
    std::this_thread::sleep_for(std::chrono::nanoseconds(after_ns));
    const bool is_late = done;
    absl::Status free;
    const int64_t ns = NanosecondsOf([&] {
      context.TryCancel();
      free = AskInfo();
    });
    asker.join();
    DSG_RETURN_IF_ERROR(free);
    if (is_late || answered.ok()) {
      ++*missed_count;
    } else {
      samples->Add(ns);
    }
    return absl::OkStatus();
  }

  const WirePlace place_;
  WireServer server_;
  WireClient client_;
};

}  // namespace

absl::Status MeasureCancels(const WirePlace& place, int repeat_count, Report* report) {
  Canceller canceller(place);
  for (const LongQuestion& question : LongQuestions()) {
    DSG_RETURN_IF_ERROR(canceller.Measure(question, repeat_count, report));
    ShowProgress(absl::StrCat("cancels of ", question.name, " done"));
  }
  return absl::OkStatus();
}

}  // namespace dsg::bench
