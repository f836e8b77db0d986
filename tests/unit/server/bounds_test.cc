// SPDX-License-Identifier: Apache-2.0
// How a server treats callers that wait, leave, do not read, or are too many.
#include <gtest/gtest.h>

#include <future>

#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::system_clock;
using test::kMap;
using test::kSecond;

class Bounds : public testing::Test {
 protected:
  Bounds() { test::MakeOffice(folder_.path()); }
  ~Bounds() override { gate_->Open(); }

  void Start(int worker_count, int in_flight_max, int open_stream_max = 8) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.worker_count = worker_count;
    options.in_flight_max = in_flight_max;
    options.open_stream_max = open_stream_max;
    auto server =
        Server::Start(std::make_unique<HeldCore>(test::OpenCore(folder_.path()), gate_), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    maps_ = v1::MapService::NewStub(channel_);
    query_ = v1::QueryService::NewStub(channel_);
  }

  // A call that the gate holds.
  std::future<grpc::Status> Hold(grpc::ClientContext* context) {
    return std::async(std::launch::async, [this, context] {
      v1::ListMapsResponse reply;
      return maps_->ListMaps(context, {}, &reply);
    });
  }

  grpc::Status AskInfo(grpc::ClientContext* context) {
    v1::GetServerInfoResponse reply;
    return maps_->GetServerInfo(context, {}, &reply);
  }

  // A stream of 300,000 poses, about 20 MB: more than sockets and flow control buffer.
  std::unique_ptr<grpc::ClientReader<v1::GetTrajectoryResponse>> OpenBigStream(
      grpc::ClientContext* context) {
    v1::GetTrajectoryRequest request;
    request.set_map(kMap);
    request.set_agent("walker");
    request.set_resample_period_ns(1'000'000);
    return query_->GetTrajectory(context, request);
  }

  void AddWalker() {
    GraphDelta delta;
    const NodeId walker('H', 50);
    delta.nodes = {test::MakeNode(walker, layers::kAgents, kinds::kHuman, "walker", Box3d())};
    delta.appends = {{walker, {}}};
    for (int t = 0; t <= 300; ++t) {
      delta.appends[0].poses.push_back(test::PoseAt(t * kSecond, 1 + 0.01 * t, 5, 1));
    }
    test::CommitToOffice(folder_.path(), std::move(delta));
  }

  test::TempFolder folder_;
  std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::MapService::Stub> maps_;
  std::unique_ptr<v1::QueryService::Stub> query_;
};

TEST_F(Bounds, RefusesCallsBeyondTheBoundAtOnceAndRecovers) {
  Start(1, 1);
  grpc::ClientContext held_context;
  auto held = Hold(&held_context);
  gate_->WaitForRunning(1);
  grpc::ClientContext context;
  EXPECT_EQ(AskInfo(&context).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailOf(context).reason(), v1::OVERLOADED);
  gate_->Open();
  EXPECT_TRUE(held.get().ok());
  // The worker counts the call as running until shortly after the caller has its answer.
  bool recovered = false;
  for (int i = 0; i < 1000 && !recovered; ++i) {
    grpc::ClientContext later;
    recovered = AskInfo(&later).ok();
  }
  EXPECT_TRUE(recovered);
}

TEST_F(Bounds, StopsTheWorkWhenTheCallerCancels) {
  Start(1, 4);
  grpc::ClientContext context;
  auto held = Hold(&context);
  gate_->WaitForRunning(1);
  context.TryCancel();
  EXPECT_EQ(held.get().error_code(), grpc::StatusCode::CANCELLED);
  gate_->WaitForRunning(0);
  EXPECT_EQ(gate_->last_stop().code(), absl::StatusCode::kCancelled);
}

TEST_F(Bounds, StopsTheWorkAtTheCallersDeadline) {
  Start(1, 4);
  grpc::ClientContext context;
  context.set_deadline(system_clock::now() + milliseconds(100));
  auto held = Hold(&context);
  EXPECT_EQ(held.get().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  gate_->WaitForRunning(0);
  EXPECT_FALSE(gate_->is_open());
}

TEST_F(Bounds, DoesNotBeginACallWhoseDeadlinePassedInTheQueue) {
  Start(1, 4);
  grpc::ClientContext first_context;
  auto first = Hold(&first_context);
  gate_->WaitForRunning(1);
  grpc::ClientContext late_context;
  late_context.set_deadline(system_clock::now() + milliseconds(50));
  auto late = Hold(&late_context);
  EXPECT_EQ(late.get().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  gate_->Open();
  EXPECT_TRUE(first.get().ok());
}

TEST_F(Bounds, KeepsAnsweringWhileAReaderDoesNotRead) {
  AddWalker();
  Start(1, 8);
  grpc::ClientContext stream_context;
  const auto reader = OpenBigStream(&stream_context);
  v1::GetTrajectoryResponse message;
  ASSERT_TRUE(reader->Read(&message));
  // The only worker must be free each time, although the stream is open.
  for (int i = 0; i < 100; ++i) {
    grpc::ClientContext context;
    context.set_deadline(system_clock::now() + std::chrono::seconds(10));
    ASSERT_TRUE(AskInfo(&context).ok());
  }
  stream_context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(Bounds, SendsAllOfALongStreamToAReaderThatReads) {
  AddWalker();
  Start(2, 8);
  grpc::ClientContext context;
  context.set_deadline(system_clock::now() + std::chrono::seconds(50));
  const auto reader = OpenBigStream(&context);
  v1::GetTrajectoryResponse message;
  int64_t next_ns = 0;
  while (reader->Read(&message)) {
    for (const auto& pose : message.poses()) {
      ASSERT_EQ(pose.time_ns(), next_ns);
      next_ns += 1'000'000;
    }
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(next_ns, 300 * kSecond + 1'000'000);
}

TEST_F(Bounds, RefusesMoreOpenStreamsThanItsBound) {
  AddWalker();
  Start(1, 100, 2);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::GetTrajectoryResponse>>> readers;
  v1::GetTrajectoryResponse message;
  for (int i = 0; i < 2; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    readers.push_back(OpenBigStream(contexts.back().get()));
    ASSERT_TRUE(readers.back()->Read(&message));
  }
  grpc::ClientContext third_context;
  const auto third = OpenBigStream(&third_context);
  EXPECT_FALSE(third->Read(&message));
  EXPECT_EQ(third->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  for (int i = 0; i < 2; ++i) {
    contexts[static_cast<size_t>(i)]->TryCancel();
    readers[static_cast<size_t>(i)]->Finish();
  }
}

TEST_F(Bounds, EndsAStreamOfACallerThatGaveNoDeadlineAndDoesNotRead) {
  AddWalker();
  Start(1, 8);
  grpc::ClientContext context;
  const auto reader = OpenBigStream(&context);
  v1::GetTrajectoryResponse message;
  ASSERT_TRUE(reader->Read(&message));
  // Shutdown waits for the stream, which must end by its default deadline of 5 s and not by being
  // cancelled after the long grace. The reader does not read meanwhile.
  const auto begin = std::chrono::steady_clock::now();
  server_->Shutdown(std::chrono::seconds(40));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  int message_count = 1;
  while (reader->Read(&message)) ++message_count;
  EXPECT_LT(message_count, 300);
  EXPECT_FALSE(reader->Finish().ok());
}

TEST_F(Bounds, ShutsDownInTimeThoughAStreamIsOpenAndACallRuns) {
  AddWalker();
  Start(2, 8);
  grpc::ClientContext stream_context;
  const auto reader = OpenBigStream(&stream_context);
  v1::GetTrajectoryResponse message;
  ASSERT_TRUE(reader->Read(&message));
  grpc::ClientContext held_context;
  auto held = Hold(&held_context);
  gate_->WaitForRunning(1);
  const auto begin = std::chrono::steady_clock::now();
  server_->Shutdown(milliseconds(300));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_FALSE(held.get().ok());
  while (reader->Read(&message)) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

TEST_F(Bounds, LetsRunningCallsEndWhenItShutsDown) {
  Start(2, 8);
  grpc::ClientContext context;
  auto held = Hold(&context);
  gate_->WaitForRunning(1);
  auto stopped =
      std::async(std::launch::async, [this] { server_->Shutdown(std::chrono::seconds(20)); });
  gate_->Open();
  EXPECT_TRUE(held.get().ok());
  stopped.get();
}

}  // namespace
}  // namespace dsg::server
