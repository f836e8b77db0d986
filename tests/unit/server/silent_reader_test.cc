// SPDX-License-Identifier: Apache-2.0
// Readers that open a stream and then do not read. The tests count the messages that these hold,
// not the time that others wait.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
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

// Makes all messages at once.
constexpr int kNoneHeld = 0;

// Counts the messages produced for streams of the mesh. Message number `held` of a stream, from 1,
// is made when the call is over.
class CountingCore final : public PassingCore {
 public:
  CountingCore(std::unique_ptr<query::ServiceCore> core, std::atomic<int>* message_count, int held)
      : PassingCore(std::move(core)), message_count_(message_count), held_(held) {}

  query::CursorOr<v1::GetMeshResponse> GetMesh(const query::CallContext& call,
                                               const v1::GetMeshRequest& request) override {
    auto cursor = PassingCore::GetMesh(call, request);
    if (!cursor.ok()) return cursor;
    return std::make_unique<Cursor>(*std::move(cursor), message_count_, held_);
  }

 private:
  class Cursor final : public query::StreamCursor<v1::GetMeshResponse> {
   public:
    Cursor(std::unique_ptr<query::StreamCursor<v1::GetMeshResponse>> cursor,
           std::atomic<int>* message_count, int held)
        : cursor_(std::move(cursor)), message_count_(message_count), held_(held) {}
    absl::StatusOr<bool> Next(const query::CallContext& call, v1::GetMeshResponse* reply) override {
      ++*message_count_;
      ++own_count_;
      while (own_count_ == held_ && call.Check().ok()) {
        std::this_thread::sleep_for(milliseconds(1));
      }
      return cursor_->Next(call, reply);
    }
    bool done() const override { return cursor_->done(); }

   private:
    std::unique_ptr<query::StreamCursor<v1::GetMeshResponse>> cursor_;
    std::atomic<int>* message_count_;
    const int held_;
    int own_count_ = 0;
  };

  std::atomic<int>* message_count_;
  const int held_;
};

// A stream of the whole mesh over HTTP, of which nothing is read until ReadAll.
class HttpMeshReader {
 public:
  HttpMeshReader(const std::string& path, milliseconds timeout)
      : fd_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    v1::GetMeshRequest request;
    request.set_map(test::kMap);
    const std::string message = request.SerializeAsString();
    const std::string envelope = {0, 0, 0, 0, static_cast<char>(message.size())};
    const std::string bytes = absl::StrCat(
        "POST /dsg.v1.QueryService/GetMesh HTTP/1.1\r\nHost: localhost\r\n",
        "Content-Type: application/connect+proto\r\nConnect-Timeout-Ms: ", timeout.count(),
        "\r\nContent-Length: ", envelope.size() + message.size(), "\r\n\r\n", envelope, message);
    is_asked_ =
        connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
        send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  ~HttpMeshReader() { close(fd_); }
  HttpMeshReader(const HttpMeshReader&) = delete;
  HttpMeshReader& operator=(const HttpMeshReader&) = delete;

  bool is_asked() const { return is_asked_; }
  // Until the stream ends, or the connection. The first `slow_bytes` at most at a megabyte a
  // second.
  std::string ReadAll(size_t slow_bytes = 0) const {
    constexpr char kEnd[] = "\r\n0\r\n\r\n";
    std::string all;
    std::array<char, size_t{16} << 10> part;
    while (!absl::EndsWith(all, kEnd)) {
      if (all.size() < slow_bytes) std::this_thread::sleep_for(milliseconds(16));
      const ssize_t count = recv(fd_, part.data(), part.size(), 0);
      if (count <= 0) break;
      all.append(part.data(), static_cast<size_t>(count));
    }
    return all;
  }

 private:
  const int fd_;
  bool is_asked_ = false;
};

class SilentReader : public testing::Test {
 protected:
  SilentReader() {
    test::MakeOffice(folder_.path());
    test::CommitToOffice(folder_.path(), MeshDelta());
  }

  void Start(milliseconds reader_stall_max = seconds(30), int held = kNoneHeld) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.http.listen = "unix:" + http_path();
    options.worker_count = 2;
    options.reader_stall_max = reader_stall_max;
    auto server = Server::Start(
        std::make_unique<CountingCore>(test::OpenCore(folder_.path()), &message_count_, held),
        options);
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

  std::string http_path() const { return folder_.path() + "/http.sock"; }

  // Long before the readers' deadline, where they have a long one.
  bool AllStreamsEnd() {
    const auto end = system_clock::now() + seconds(20);
    while (server_->Load().open_stream_count > 0) {
      if (system_clock::now() > end) return false;
      std::this_thread::yield();
    }
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

TEST_F(SilentReader, HasTheNextMessageWaitingOverHttp) {
  Start();
  const HttpMeshReader reader(http_path(), seconds(60));
  ASSERT_TRUE(reader.is_asked());
  while (message_count_ < 2) std::this_thread::yield();
  ASSERT_TRUE(ComesToRest());
  // The first fills the socket, the second was made meanwhile.
  EXPECT_EQ(message_count_, 2);
}

TEST_F(SilentReader, IsGivenUpOverHttp) {
  Start(milliseconds(200));
  const HttpMeshReader reader(http_path(), seconds(60));
  ASSERT_TRUE(reader.is_asked());
  while (message_count_ < 2) std::this_thread::yield();
  EXPECT_TRUE(AllStreamsEnd());
}

TEST_F(SilentReader, IsNotASlowOneOverHttp) {
  // A message takes a second.
  Start(milliseconds(300));
  const HttpMeshReader reader(http_path(), seconds(60));
  ASSERT_TRUE(reader.is_asked());
  const std::string answer = reader.ReadAll(/*slow_bytes=*/size_t{3} << 20);
  EXPECT_TRUE(absl::EndsWith(answer, "\r\n0\r\n\r\n")) << answer.size();
  EXPECT_EQ(answer.find("error"), std::string::npos);
}

// Then nothing waits behind what the reader does not take.
TEST_F(SilentReader, IsGivenUpOverHttpWhenItsDeadlinePassesWhileAMessageIsMade) {
  Start(milliseconds(200), /*held=*/2);
  const HttpMeshReader reader(http_path(), milliseconds(300));
  ASSERT_TRUE(reader.is_asked());
  while (message_count_ < 2) std::this_thread::yield();
  EXPECT_TRUE(AllStreamsEnd());
}

TEST_F(SilentReader, IsToldOverHttpThatItsDeadlinePassedWhenItReadsAgain) {
  for (const int held : {kNoneHeld, 2}) {
    SCOPED_TRACE(held);
    message_count_ = 0;
    Start(seconds(30), held);
    constexpr milliseconds kTimeout(300);
    const HttpMeshReader reader(http_path(), kTimeout);
    ASSERT_TRUE(reader.is_asked());
    while (message_count_ < 2) std::this_thread::yield();
    std::this_thread::sleep_for(2 * kTimeout);
    const std::string answer = reader.ReadAll();
    EXPECT_TRUE(absl::EndsWith(answer, "\r\n0\r\n\r\n"));
    EXPECT_NE(answer.rfind("deadline_exceeded"), std::string::npos);
    server_.reset();
  }
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
