// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_mix.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/bench/wire_client.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 20261121;

struct Tally {
  Samples calls;
  absl::Status status;
};

void AskMixed(const QuestionFilter& filter, const WireClient& client, uint64_t stream,
              const std::atomic<bool>& stop, Tally* tally) {
  Random random(kSeed, stream);
  const auto questions = QuestionsWanted(filter);
  while (!stop && tally->status.ok()) {
    Question* question =
        questions[static_cast<size_t>(random.Index(static_cast<int>(questions.size())))].get();
    question->Draw(&random);
    tally->calls.Add(NanosecondsOf([&] { tally->status = question->AskServer(client); }));
  }
}

}  // namespace

absl::Status MeasureMix(const QuestionFilter& filter, const MixOptions& options,
                        const std::string& address, Report* report) {
  std::vector<WireClient> clients;
  for (int i = 0; i < options.client_count; ++i) {
    DSG_ASSIGN_OR_RETURN(WireClient client, Connect(address));
    clients.push_back(std::move(client));
  }
  std::vector<Tally> tallies(clients.size());
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (size_t i = 0; i < clients.size(); ++i) {
    threads.emplace_back(AskMixed, std::cref(filter), std::cref(clients[i]), 100 + i,
                         std::cref(stop), &tallies[i]);
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(options.seconds));
  stop = true;
  for (std::thread& thread : threads) thread.join();
  Samples all;
  int error_count = 0;
  for (const Tally& tally : tallies) {
    all.Append(tally.calls);
    if (!tally.status.ok()) ++error_count;
    if (!tally.status.ok()) report->Note(tally.status.ToString());
  }
  const std::string what = absl::StrCat(options.client_count, " clients, all questions mixed, ");
  report->Line(absl::StrCat(what, all.count(), " calls, latency"), "ms", Milliseconds(all), {}, {});
  report->Line(absl::StrCat(what, "clients that met an error"), "",
               {static_cast<double>(error_count), {}}, {}, {Target::Kind::kAtMost, 0.0});
  return absl::OkStatus();
}

}  // namespace dsg::bench
