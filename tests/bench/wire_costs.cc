// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_costs.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "query/service/service_core.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 20261121;
constexpr double kWireRatioMax = 1.3;

// What one question has cost, in turn, so that noise hits all three alike.
struct Costs {
  Samples engine;
  Samples server;
  Samples floor;
};

absl::Status AskInfo(const WireClient& client) {
  v1::GetServerInfoResponse info;
  return FromGrpc(Call(client.map.get(), &v1::MapService::Stub::GetServerInfo,
                       v1::GetServerInfoRequest(), &info));
}

absl::Status MeasureOnce(int i, Question* question, query::Api* engine, const WireClient& client,
                         Costs* costs) {
  absl::Status status;
  // Who comes later finds warmer caches and connections; take turns.
  for (int k = 0; k < 3; ++k) {
    absl::Status asked;
    switch ((i + k) % 3) {
      case 0:
        costs->engine.Add(NanosecondsOf([&] { asked = question->AskEngine(engine); }));
        break;
      case 1:
        costs->server.Add(NanosecondsOf([&] { asked = question->AskServer(client); }));
        break;
      default:
        costs->floor.Add(NanosecondsOf([&] { asked = AskInfo(client); }));
    }
    status.Update(asked);
  }
  if (status.ok() && question->engine_bytes() != question->server_bytes()) {
    return absl::DataLossError("the server's answer is not the engine's");
  }
  return status;
}

// Processor time of both processes for one of `count` questions, microseconds.
template <typename Ask>
absl::StatusOr<double> CpuUsOf(int count, const WireServer& server, Ask&& ask) {
  const auto used_ns = [&] { return server.process->CpuNs() + ProcessCpuNs(); };
  const int64_t before_ns = used_ns();
  for (int i = 0; i < count; ++i) DSG_RETURN_IF_ERROR(ask());
  return static_cast<double>(used_ns() - before_ns) / 1e3 / count;
}

// What a busy machine does not stretch. In blocks, since a call's last work follows its answer.
absl::Status MeasureCpu(const Costs& costs, Question* question, query::Api* engine,
                        const WireServer& server, const WireClient& client, Report* report) {
  constexpr int kRoundCount = 3;
  constexpr double kRoundUs = 200e3;
  const double each_us = Microseconds(costs.server).value + Microseconds(costs.engine).value;
  const int count = std::clamp(static_cast<int>(kRoundUs / each_us), 3, 200);
  Random random(kSeed, 1);
  double ours_us = 0;
  double floor_us = 0;
  double engine_us = 0;
  for (int i = 0; i < kRoundCount; ++i) {
    DSG_ASSIGN_OR_RETURN(const double ours, CpuUsOf(count, server, [&] {
                           question->Draw(&random);
                           return question->AskServer(client);
                         }));
    DSG_ASSIGN_OR_RETURN(const double floor,
                         CpuUsOf(count, server, [&] { return AskInfo(client); }));
    DSG_ASSIGN_OR_RETURN(const double alone, CpuUsOf(count, server, [&] {
                           question->Draw(&random);
                           return question->AskEngine(engine);
                         }));
    ours_us += ours / kRoundCount;
    floor_us += floor / kRoundCount;
    engine_us += alone / kRoundCount;
  }
  report->Line("  its processor time, both ends", "us", {ours_us, {}},
               Rival{absl::StrCat("empty call ", static_cast<int>(floor_us), " + engine ",
                                  static_cast<int>(engine_us), " ="),
                     {floor_us + engine_us, {}}},
               {});
  return absl::OkStatus();
}

// `count` rounds, or as many as `most_ns` allows.
absl::Status MeasureRounds(int count, int64_t most_ns, Question* question, query::Api* engine,
                           const WireClient& client, Random* random, Costs* costs) {
  int64_t spent_ns = 0;
  for (int i = 0; i < count && spent_ns < most_ns; ++i) {
    question->Draw(random);
    absl::Status asked;
    spent_ns += NanosecondsOf([&] { asked = MeasureOnce(i, question, engine, client, costs); });
    DSG_RETURN_IF_ERROR(asked);
  }
  return absl::OkStatus();
}

absl::Status MeasureQuestion(int call_count, Question* question, query::Api* engine,
                             const WireServer& server, const WireClient& client, Report* report) {
  constexpr int kWarmupCount = 20;
  constexpr int64_t kMostNs = 2'000'000'000;
  Random random(kSeed, 0);
  Costs warmup;
  Costs costs;
  // The first round of some reads the graph, so that the time it takes says nothing.
  absl::Status asked = MeasureRounds(1, kMostNs, question, engine, client, &random, &warmup);
  asked.Update(
      MeasureRounds(kWarmupCount, kMostNs / 4, question, engine, client, &random, &warmup));
  asked.Update(MeasureRounds(call_count, kMostNs, question, engine, client, &random, &costs));
  if (!asked.ok()) {
    report->Line(absl::StrCat(question->name(), " failed: ", std::string(asked.message())), "",
                 {1.0, {}}, {}, {Target::Kind::kAtMost, 0.0});
    return absl::OkStatus();
  }
  const Figure engine_us = Microseconds(costs.engine);
  const Figure floor_us = Microseconds(costs.floor);
  report->Line(question->name(), "us", Microseconds(costs.server),
               Rival{absl::StrCat("empty call ", static_cast<int>(floor_us.value), " + engine ",
                                  static_cast<int>(engine_us.value), " (p99 ",
                                  static_cast<int>(*engine_us.p99), ") ="),
                     {floor_us.value + engine_us.value, {}}},
               {Target::Kind::kRatioAtMost, kWireRatioMax});
  return MeasureCpu(costs, question, engine, server, client, report);
}

}  // namespace

absl::Status MeasureQuestions(const std::vector<std::unique_ptr<Question>>& questions,
                              int call_count, const std::string& store, const WireServer& server,
                              const WireClient& client, Report* report) {
  DSG_ASSIGN_OR_RETURN(auto opened, GraphStore::Open(store, {}));
  const auto engine = query::MakeServiceCore(std::move(opened));
  for (const auto& question : questions) {
    DSG_RETURN_IF_ERROR(
        MeasureQuestion(call_count, question.get(), engine.get(), server, client, report));
  }
  return absl::OkStatus();
}

}  // namespace dsg::bench
