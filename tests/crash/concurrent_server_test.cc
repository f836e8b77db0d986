// SPDX-License-Identifier: Apache-2.0
// dsg-ingest writes a map while dsg-server answers questions about it, in two processes: no error,
// no answer that changes, and what is committed is answered at once.
//
// DSG_SECONDS how long, 5 by default; DSG_SEED which questions.
#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/client/remote_api.h"
#include "tests/crash/people_log.h"
#include "tests/crash/process.h"
#include "tests/crash/visibility.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

std::string Binary(const char* name) { return std::string(DSG_BINARY_DIR) + "/" + name; }

query::CallContext Within(int seconds) {
  return query::CallContext(query::CallContext::Clock::now() + std::chrono::seconds(seconds));
}

// Asks about people by the names that the logs give them, and remembers nothing but errors.
class Clients {
 public:
  Clients(std::string address, std::string store, uint64_t seed)
      : address_(std::move(address)), store_(std::move(store)), seed_(seed) {}

  // Waits until the server answers; false if it never does.
  bool Connect() {
    const auto api = OrDie(client::Connect(address_));
    const query::CallContext call = Within(30);
    while (query::CallContext::Clock::now() < call.deadline()) {
      v1::GetServerInfoResponse reply;
      if (api->GetServerInfo(call, {}, &reply).ok()) return true;
      sched_yield();
    }
    return false;
  }

  // The newest revision as the store's file says, looked at from this process.
  void WatchStore() {
    const auto map = OrDie(OrDie(GraphStore::Open(store_, {}))->OpenMap(kMap));
    while (!stop_) {
      const int64_t begin_ns = SteadyNs();
      const Revision revision = OrDie(map->Head()).revision;
      store_looks_.Add(begin_ns, SteadyNs(), revision);
      sched_yield();
    }
  }

  // The newest revision as the server says.
  void WatchServer() {
    const auto api = OrDie(client::Connect(address_));
    v1::GetMapStatsRequest request;
    request.set_map(kMap);
    int64_t last = 0;
    while (!stop_) {
      v1::GetMapStatsResponse reply;
      const int64_t begin_ns = SteadyNs();
      if (const auto asked = api->GetMapStats(Within(10), request, &reply); !asked.ok()) {
        return Fail(asked.ToString());
      }
      const int64_t revision = reply.header().read_revision();
      if (revision < last) return Fail(absl::StrCat("revision ", revision, " after ", last));
      last = revision;
      server_looks_.Add(begin_ns, SteadyNs(), revision);
    }
  }

  // Where was somebody, and who was in a box? Asked of the newest revision, then twice of the
  // revision that answered.
  void Ask(uint64_t number) {
    const auto api = OrDie(client::Connect(address_));
    std::mt19937_64 random(seed_ + number);
    while (!stop_) {
      v1::LocateAgentRequest where;
      where.set_map(kMap);
      where.set_agent(absl::StrCat("0-", 1 + random() % 60));
      where.set_at_ns(static_cast<int64_t>(random() % 400) * kSecond / 2);
      AskTwice(&where, [&](const query::CallContext& call, const v1::LocateAgentRequest& request,
                           v1::LocateAgentResponse* reply) {
        return api->LocateAgent(call, request, reply);
      });
      v1::ListPresenceRequest who;
      who.set_map(kMap);
      const auto x = static_cast<double>(random() % 80);
      who.mutable_box()->mutable_min()->set_x(x);
      who.mutable_box()->mutable_min()->set_y(10.0);
      who.mutable_box()->mutable_min()->set_z(-1.0);
      who.mutable_box()->mutable_max()->set_x(x + 8.0);
      who.mutable_box()->mutable_max()->set_y(20.0);
      who.mutable_box()->mutable_max()->set_z(3.0);
      who.set_from_ns(static_cast<int64_t>(random() % 300) * kSecond);
      who.set_to_ns(who.from_ns() + 60 * kSecond);
      AskTwice(&who, [&](const query::CallContext& call, const v1::ListPresenceRequest& request,
                         v1::ListPresenceResponse* reply) {
        return api->ListPresence(call, request, reply);
      });
    }
  }

  void Stop() { stop_ = true; }
  const LookLog& store_looks() const { return store_looks_; }
  const LookLog& server_looks() const { return server_looks_; }
  int64_t answer_count() const { return answer_count_; }
  int64_t refusal_count() const { return refusal_count_; }
  const std::vector<std::string>& failures() const { return failures_; }

 private:
  template <typename Request, typename Call>
  void AskTwice(Request* request, const Call& call) {
    using Reply = std::remove_pointer_t<decltype(ReplyOf(*request))>;
    Reply latest;
    const absl::Status asked = call(Within(10), *request, &latest);
    // Somebody may not be there yet, or not any more, at this revision.
    const Reason reason = ReasonOf(asked);
    if (reason == Reason::kAgentUnknown || reason == Reason::kTimeOutsideTrack) {
      ++refusal_count_;
      return;
    }
    if (!asked.ok()) return Fail(asked.ToString());
    request->mutable_read_at()->set_exact_revision(latest.header().read_revision());
    for (int i = 0; i < 2; ++i) {
      Reply again;
      if (const auto status = call(Within(10), *request, &again); !status.ok()) {
        return Fail(status.ToString());
      }
      if (again.header().head_revision() < latest.header().head_revision()) {
        Fail("the newest revision went back");
      }
      // The newest revision may be newer by now, and a page token is bound to its question; all
      // else must be the same.
      *again.mutable_header() = latest.header();
      TakeToken(latest, &again);
      if (again.SerializeAsString() != latest.SerializeAsString()) {
        Fail(absl::StrCat("another answer at revision ", latest.header().read_revision(), ": ",
                          again.ShortDebugString(), " before: ", latest.ShortDebugString()));
      }
    }
    ++answer_count_;
  }
  static void TakeToken(const v1::LocateAgentResponse&, v1::LocateAgentResponse*) {}
  static void TakeToken(const v1::ListPresenceResponse& from, v1::ListPresenceResponse* to) {
    if (!from.next_page_token().empty() && !to->next_page_token().empty()) {
      to->set_next_page_token(from.next_page_token());
    }
  }
  static v1::LocateAgentResponse* ReplyOf(const v1::LocateAgentRequest&);
  static v1::ListPresenceResponse* ReplyOf(const v1::ListPresenceRequest&);

  void Fail(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (failures_.size() < 10) failures_.push_back(what);
  }

  std::string address_;
  std::string store_;
  uint64_t seed_;
  std::atomic<bool> stop_{false};
  LookLog store_looks_;
  LookLog server_looks_;
  std::atomic<int64_t> answer_count_{0};
  std::atomic<int64_t> refusal_count_{0};
  std::mutex mutex_;
  std::vector<std::string> failures_;
};

// Ingests one made-up log after another until the time is up; how many.
int IngestUntil(const std::string& folder, const std::string& store, int64_t end_ns) {
  int log_count = 0;
  for (; SteadyNs() < end_ns; ++log_count) {
    const std::string log = absl::StrCat(folder, "/people-", log_count, ".txt");
    std::ofstream(log) << PeopleLog(100 + static_cast<uint64_t>(log_count), 20'000);
    Process ingest = Process::Run(
        {Binary("dsg-ingest"), "--store", store, "--map", kMap, "--format", "trajnet",
         "--agent-prefix", absl::StrCat(log_count, "-"), "--commit-poses", "100", "--quiet", log},
        folder + "/ingest.log");
    // The last log is cut off when the time is up: the store must bear it.
    while (!ingest.HasEnded() && SteadyNs() < end_ns) sched_yield();
    if (!ingest.HasEnded()) {
      ingest.Kill();
      ingest.Wait();
    } else {
      EXPECT_EQ(ingest.Wait().exit_code, 0) << ReadFile(folder + "/ingest.log");
    }
  }
  return log_count;
}

TEST(ServedMap, AnswersWholeRevisionsAtOnceWhileItIsIngested) {
  if (!std::filesystem::exists(Binary("dsg-ingest")) ||
      !std::filesystem::exists(Binary("dsg-server"))) {
    GTEST_SKIP() << "dsg-ingest and dsg-server are not built";
  }
  const uint64_t seed = RecordSeed();
  const int64_t length_ns = EnvNumber("DSG_SECONDS", 5) * kSecond;
  TempFolder folder;
  const std::string store = folder.path() + "/store";
  StoreOptions options;
  options.create = true;
  {
    const auto made = OrDie(GraphStore::Open(store, options));
    OrDie(made->CreateMap(Spec(TrajectoryCodec::kQuantized)));
    OrDie(OrDie(made->OpenWriter(kMap))->Commit(DeltaOfStream({}, 1)));
  }
  const std::string address = "unix:" + folder.path() + "/s";
  Process server = Process::Run({Binary("dsg-server"), "--store", store, "--listen", address},
                                folder.path() + "/server.log");
  Clients clients(address, store, seed);
  ASSERT_TRUE(clients.Connect()) << ReadFile(folder.path() + "/server.log");

  std::vector<std::thread> threads;
  threads.emplace_back([&] { clients.WatchStore(); });
  threads.emplace_back([&] { clients.WatchServer(); });
  for (uint64_t i = 0; i < 2; ++i) threads.emplace_back([&clients, i] { clients.Ask(i); });
  const int log_count = IngestUntil(folder.path(), store, SteadyNs() + length_ns);
  clients.Stop();
  for (std::thread& thread : threads) thread.join();
  server.Terminate();
  EXPECT_EQ(server.Wait().exit_code, 0) << ReadFile(folder.path() + "/server.log");

  EXPECT_EQ(clients.failures(), std::vector<std::string>());
  const auto committed = clients.store_looks().FirstSights();
  const LookLog::Result result = clients.server_looks().Compare(committed, kVisibleNs);
  std::printf("%s\n%d logs, %lld answers asked three times, %lld refusals\n",
              result.Text("dsg-ingest and dsg-server").c_str(), log_count,
              static_cast<long long>(clients.answer_count()),
              static_cast<long long>(clients.refusal_count()));
  EXPECT_EQ(result.late_count, 0) << "revisions not answered within 200 ms";
  // A run without load proves nothing.
  EXPECT_GE(committed.size(), 20u);
  EXPECT_GE(clients.answer_count(), 10);
  EXPECT_TRUE(OrDie(OrDie(OrDie(GraphStore::Open(store, {}))->OpenMap(kMap))->Verify({}, {}))
                  .problems.empty());
}

}  // namespace
}  // namespace dsg::test
