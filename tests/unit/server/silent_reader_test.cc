// SPDX-License-Identifier: Apache-2.0
// Readers that open a stream and then do not read. The tests count the messages that these hold,
// not the time that others wait.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::system_clock;

// Counts the messages produced for streams of the mesh.
class CountingCore final : public PassingCore {
 public:
  CountingCore(std::unique_ptr<query::ServiceCore> core, std::atomic<int>* message_count)
      : PassingCore(std::move(core)), message_count_(message_count) {}

  query::CursorOr<v1::GetMeshResponse> GetMesh(const query::CallContext& call,
                                               const v1::GetMeshRequest& request) override {
    auto cursor = PassingCore::GetMesh(call, request);
    if (!cursor.ok()) return cursor;
    return std::make_unique<Cursor>(*std::move(cursor), message_count_);
  }

 private:
  class Cursor final : public query::StreamCursor<v1::GetMeshResponse> {
   public:
    Cursor(std::unique_ptr<query::StreamCursor<v1::GetMeshResponse>> cursor,
           std::atomic<int>* message_count)
        : cursor_(std::move(cursor)), message_count_(message_count) {}
    absl::StatusOr<bool> Next(const query::CallContext& call, v1::GetMeshResponse* reply) override {
      ++*message_count_;
      return cursor_->Next(call, reply);
    }
    bool done() const override { return cursor_->done(); }

   private:
    std::unique_ptr<query::StreamCursor<v1::GetMeshResponse>> cursor_;
    std::atomic<int>* message_count_;
  };

  std::atomic<int>* message_count_;
};

class SilentReader : public testing::Test {
 protected:
  SilentReader() {
    test::MakeOffice(folder_.path());
    test::CommitToOffice(folder_.path(), MeshDelta());
  }

  void Start(milliseconds reader_stall_max = seconds(30)) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.worker_count = 2;
    options.reader_stall_max = reader_stall_max;
    auto server = Server::Start(
        std::make_unique<CountingCore>(test::OpenCore(folder_.path()), &message_count_), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }

  grpc::Status AskInfo() {
    grpc::ClientContext context;
    context.set_deadline(system_clock::now() + seconds(20));
    v1::GetServerInfoResponse reply;
    return v1::MapService::NewStub(channel_)->GetServerInfo(&context, {}, &reply);
  }

  // Sends calls one after the other until the streams have made no progress during a hundred of
  // them and no worker is busy.
  bool ComesToRest() {
    constexpr int kQuietCount = 100;
    int quiet_count = 0;
    for (int i = 0; i < 20'000; ++i) {
      const int before = message_count_;
      if (!AskInfo().ok()) return false;
      const bool is_quiet = message_count_ == before && server_->Load().queued_count == 0;
      quiet_count = is_quiet ? quiet_count + 1 : 0;
      if (quiet_count >= kQuietCount && server_->Load().running_count == 0) return true;
    }
    return false;
  }

  // Ends at the latest with the deadline of the readers.
  bool AllStreamsEnd() {
    while (server_->Load().open_stream_count > 0) std::this_thread::yield();
    return true;
  }

  test::TempFolder folder_;
  std::atomic<int> message_count_{0};
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(SilentReader, HoldsNoWorkerAndFewMessages) {
  constexpr int kReaderCount = 12;
  Start();
  std::vector<std::unique_ptr<MeshReader>> readers;
  for (int i = 0; i < kReaderCount; ++i) {
    readers.push_back(std::make_unique<MeshReader>(server_->address()));
    ASSERT_TRUE(readers.back()->Read());
  }
  ASSERT_TRUE(ComesToRest());
  const ServerLoad load = server_->Load();
  EXPECT_EQ(load.running_count, 0);
  EXPECT_EQ(load.queued_count, 0);
  EXPECT_EQ(load.open_stream_count, kReaderCount);
  // What gRPC and the kernel buffer of a stream of about forty messages.
  EXPECT_LT(message_count_, 16 * kReaderCount);
  readers.clear();
  EXPECT_TRUE(AllStreamsEnd());
}

TEST_F(SilentReader, IsGivenUpWithAReasonLongBeforeItsDeadline) {
  Start(milliseconds(200));
  MeshReader reader(server_->address());
  ASSERT_TRUE(reader.Read());
  ASSERT_TRUE(AllStreamsEnd());
  const grpc::Status status = reader.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_NE(status.error_message().find("took no message"), std::string::npos)
      << status.error_message();
}

TEST_F(SilentReader, IsGivenUpThoughOthersRead) {
  Start(milliseconds(500));
  MeshReader silent(server_->address());
  ASSERT_TRUE(silent.Read());
  int whole_count = 0;
  while (server_->Load().open_stream_count > 0) {
    MeshReader eager(server_->address());
    while (eager.Read()) {
    }
    ASSERT_TRUE(eager.Finish().ok());
    ++whole_count;
  }
  EXPECT_GE(whole_count, 1);
}

}  // namespace
}  // namespace dsg::server
