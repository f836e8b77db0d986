// SPDX-License-Identifier: Apache-2.0
// Watches over the wire: many at once, readers that leave or do not read, ends of the map and of
// the server.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "server/call_deadline.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::system_clock;
using test::kMap;

GraphDelta DeltaOfObject(uint64_t index) {
  GraphDelta delta;
  delta.nodes = {test::MakeNode(
      NodeId('O', index), layers::kObjects, kinds::kObject, "thing",
      Box3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(static_cast<double>(index))))};
  return delta;
}

/// A watch on its own connection.
class Watcher {
 public:
  Watcher(const std::string& address, const v1::WatchMapRequest& request,
          milliseconds deadline = seconds(60)) {
    stub_ = v1::MapService::NewStub(ConnectAlone(address));
    // Ends a test that goes wrong.
    context_.set_deadline(system_clock::now() + deadline);
    reader_ = stub_->WatchMap(&context_, request);
  }
  ~Watcher() {
    context_.TryCancel();
    if (!is_finished_) Finish();
  }

  bool Read(v1::WatchMapResponse* message) { return reader_->Read(message); }
  grpc::Status Finish() {
    is_finished_ = true;
    // Only an ended stream can be finished.
    v1::WatchMapResponse rest;
    while (reader_->Read(&rest)) {
    }
    return reader_->Finish();
  }
  void Cancel() { context_.TryCancel(); }
  grpc::ClientContext& context() { return context_; }

 private:
  std::unique_ptr<v1::MapService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>> reader_;
  bool is_finished_ = false;
};

class WatchTest : public testing::Test {
 protected:
  WatchTest() { test::MakeOffice(folder_.path()); }

  void Start(int open_watch_max = 256) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.worker_count = 2;
    options.open_stream_max = 1;
    options.open_watch_max = open_watch_max;
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  static v1::WatchMapRequest Request() {
    v1::WatchMapRequest request;
    request.set_map(kMap);
    return request;
  }

  // A second watch is accepted within bounded time.
  bool IsLetIn() {
    const auto give_up = std::chrono::steady_clock::now() + seconds(20);
    while (std::chrono::steady_clock::now() < give_up) {
      Watcher next(server_->address(), Request());
      v1::WatchMapResponse message;
      if (next.Read(&message)) return true;
      EXPECT_EQ(next.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    }
    return false;
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
};

TEST(WatchDeadline, IsTheCallersOrNone) {
  using Steady = query::CallContext::Clock;
  EXPECT_EQ(WatchDeadline(system_clock::time_point::max()), Steady::time_point::max());
  const auto begin = Steady::now();
  const auto day = WatchDeadline(system_clock::now() + std::chrono::hours(24)) - begin;
  EXPECT_GT(day, std::chrono::hours(23));
}

TEST_F(WatchTest, BeginsAtTheHeadAndTellsWhatComes) {
  Start();
  Watcher watcher(server_->address(), Request());
  v1::WatchMapResponse message;
  ASSERT_TRUE(watcher.Read(&message));
  EXPECT_EQ(message.header().read_revision(), 1);
  EXPECT_FALSE(message.has_revision());
  test::CommitToOffice(folder_.path(), DeltaOfObject(100));
  ASSERT_TRUE(watcher.Read(&message));
  EXPECT_EQ(message.revision().revision(), 2);
  EXPECT_EQ(message.header().read_revision(), 2);
  EXPECT_TRUE(message.complete());
}

TEST_F(WatchTest, TellsAHundredWatchersEveryRevisionInOrder) {
  Start();
  constexpr int kWatcherCount = 100;
  constexpr Revision kLast = 21;
  std::atomic<int> begun_count{0};
  std::atomic<int> failure_count{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < kWatcherCount; ++i) {
    // The server ends some of more than 64 requests that arrive at once.
    while (begun_count + 50 <= i) std::this_thread::yield();
    threads.emplace_back([&, i] {
      v1::WatchMapRequest request = Request();
      request.set_after_revision(1);
      request.set_changes(i % 2 == 0);
      Watcher watcher(server_->address(), request);
      v1::WatchMapResponse message;
      Revision expected = 2;
      bool begun = false;
      while (expected <= kLast && watcher.Read(&message)) {
        if (!begun) ++begun_count;
        begun = true;
        if (!message.has_revision()) continue;
        const bool right = message.revision().revision() == expected && message.complete() &&
                           message.changes().nodes_size() == (i % 2 == 0 ? 1 : 0);
        if (!right) ++failure_count;
        ++expected;
      }
      if (expected != kLast + 1) ++failure_count;
    });
  }
  // Some begin before the first commit; all catch up.
  while (begun_count < kWatcherCount / 2) std::this_thread::yield();
  for (Revision r = 2; r <= kLast; ++r) {
    test::CommitToOffice(folder_.path(), DeltaOfObject(static_cast<uint64_t>(1000 + r)));
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failure_count, 0);
}

TEST_F(WatchTest, GivesSignsOfLifeWhileNothingHappens) {
  Start();
  v1::WatchMapRequest request = Request();
  request.set_idle_period_ns(100'000'000);
  Watcher watcher(server_->address(), request);
  v1::WatchMapResponse message;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(watcher.Read(&message));
    EXPECT_TRUE(message.has_header());
    EXPECT_FALSE(message.has_revision());
    EXPECT_EQ(message.header().read_revision(), 1);
  }
}

TEST_F(WatchTest, FreesThePlaceOfAReaderThatVanished) {
  Start(1);
  {
    Watcher first(server_->address(), Request());
    v1::WatchMapResponse message;
    ASSERT_TRUE(first.Read(&message));
    Watcher second(server_->address(), Request());
    EXPECT_FALSE(second.Read(&message));
    EXPECT_EQ(second.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(DetailOf(second.context()).reason(), v1::OVERLOADED);
  }
  EXPECT_TRUE(IsLetIn());
}

TEST_F(WatchTest, TellsOthersWhileAReaderDoesNotRead) {
  Start();
  v1::WatchMapRequest request = Request();
  request.set_changes(true);
  request.set_after_revision(0);
  Watcher lazy(server_->address(), request);
  Watcher eager(server_->address(), request);
  GraphDelta large;
  for (uint64_t i = 0; i < 3000; ++i) large.nodes.push_back(DeltaOfObject(5000 + i).nodes[0]);
  test::CommitToOffice(folder_.path(), std::move(large));
  v1::WatchMapResponse message;
  int node_count = 0;
  while (eager.Read(&message)) {
    if (message.revision().revision() != 2) continue;
    EXPECT_LE(message.changes().nodes_size(), 1000);
    node_count += message.changes().nodes_size();
    // The read revision must not pass what has been sent.
    EXPECT_EQ(message.header().read_revision(), message.complete() ? 2 : 1);
    if (message.complete()) break;
  }
  EXPECT_EQ(node_count, 3000);
}

TEST_F(WatchTest, KeepsTheCallersDeadline) {
  Start();
  Watcher watcher(server_->address(), Request(), milliseconds(300));
  v1::WatchMapResponse message;
  while (watcher.Read(&message)) {
  }
  EXPECT_EQ(watcher.Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(WatchTest, RefusesARevisionThatIsNotThereAndNamesThoseThatAre) {
  Start();
  v1::WatchMapRequest request = Request();
  request.set_after_revision(99);
  Watcher watcher(server_->address(), request);
  v1::WatchMapResponse message;
  EXPECT_FALSE(watcher.Read(&message));
  EXPECT_EQ(watcher.Finish().error_code(), grpc::StatusCode::OUT_OF_RANGE);
  const v1::ErrorDetail detail = DetailOf(watcher.context());
  EXPECT_EQ(detail.reason(), v1::REVISION_IN_FUTURE);
  EXPECT_EQ(detail.metadata().at("newest"), "1");
}

TEST_F(WatchTest, EndsWhenTheMapIsReplaced) {
  Start();
  Watcher watcher(server_->address(), Request());
  v1::WatchMapResponse message;
  ASSERT_TRUE(watcher.Read(&message));
  test::TempFolder other;
  test::MakeOffice(other.path());
  const std::string file = std::string("/") + kMap + "/graph.db";
  std::filesystem::rename(other.path() + file, folder_.path() + file);
  while (watcher.Read(&message)) {
  }
  const grpc::Status status = watcher.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_NE(status.error_message().find("replaced"), std::string::npos) << status.error_message();
}

TEST_F(WatchTest, EndsAtOnceWhenTheServerStops) {
  Start();
  Watcher watcher(server_->address(), Request());
  v1::WatchMapResponse message;
  ASSERT_TRUE(watcher.Read(&message));
  const auto begin = std::chrono::steady_clock::now();
  server_->Shutdown(seconds(50));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(25));
  EXPECT_EQ(watcher.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(DetailOf(watcher.context()).reason(), v1::SHUTTING_DOWN);
}

}  // namespace
}  // namespace dsg::server
