// SPDX-License-Identifier: Apache-2.0
// Hostile clients: their connections end, and neither the server nor other clients are affected.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/ingest_service.grpc.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "server/connections.h"
#include "server/server.h"
#include "tests/support/raw_http2.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::system_clock;

constexpr int64_t kMebibyte = 1 << 20;
constexpr char kLocate[] = "/dsg.v1.QueryService/LocateAgent";
constexpr char kCommit[] = "/dsg.v1.IngestService/Commit";
constexpr char kPlanPaths[] = "/dsg.v1.QueryService/PlanPaths";

// Samples resident memory until Growth is called.
class Peak {
 public:
  Peak() : before_(ResidentBytes()), thread_([this] { Run(); }) {}
  ~Peak() { Stop(); }
  int64_t Growth() {
    Stop();
    return peak_ - before_;
  }

 private:
  void Run() {
    while (!stopped_) {
      peak_ = std::max(peak_, ResidentBytes());
      std::this_thread::sleep_for(milliseconds(2));
    }
  }
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }

  const int64_t before_;
  int64_t peak_ = 0;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

// A call by path with `bytes` as its request, on its own connection.
class BytesCall {
 public:
  BytesCall(const std::string& address, const std::string& path, const grpc::ByteBuffer& bytes) {
    stub_ = std::make_unique<grpc::GenericStub>(ConnectAlone(address));
    context_.set_deadline(system_clock::now() + seconds(60));
    call_ = stub_->PrepareUnaryCall(&context_, path, bytes, &queue_);
    call_->StartCall();
    call_->Finish(&reply_, &status_, nullptr);
  }

  grpc::Status Wait() {
    void* tag = nullptr;
    bool ok = false;
    queue_.Next(&tag, &ok);
    return status_;
  }
  // Requires: Wait.
  v1::Reason reason() const { return DetailOf(context_).reason(); }

 private:
  std::unique_ptr<grpc::GenericStub> stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::ByteBuffer reply_;
  grpc::Status status_;
  std::unique_ptr<grpc::GenericClientAsyncResponseReader> call_;
};

// Just under 4 MiB of empty messages in a list, within a message if `outer_tag` is given.
grpc::ByteBuffer EmptyMessages(char tag, char outer_tag = 0) {
  constexpr uint32_t kCount = 2'000'000;
  std::string bytes;
  if (outer_tag != 0) {
    bytes.push_back(outer_tag);
    for (uint32_t left = 2 * kCount; left > 0; left >>= 7) {
      bytes.push_back(static_cast<char>((left & 0x7f) | (left >= 0x80 ? 0x80 : 0)));
    }
  }
  for (uint32_t i = 0; i < kCount; ++i) bytes.append({tag, '\0'});
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// 2,000,000 nodes of a delta; as many paths.
grpc::ByteBuffer EmptyNodes() { return EmptyMessages('\x52', '\x0a'); }
grpc::ByteBuffer EmptyPaths() { return EmptyMessages('\x1a'); }

class Hostile : public testing::Test {
 protected:
  Hostile() { test::MakeOffice(folder_.path()); }
  ~Hostile() override {
    gate_->Open();
    stop_ = true;
    if (bystander_.joinable()) bystander_.join();
  }

  void Start(ServerOptions options = {}) {
    options.listen = "unix:" + folder_.path() + "/server.sock";
    if (options.worker_count == 0) options.worker_count = 4;
    auto server =
        Server::Start(std::make_unique<HeldCore>(test::OpenCore(folder_.path()), gate_), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    maps_ = v1::MapService::NewStub(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
    ASSERT_TRUE(AskInfo());
  }

  bool AskInfo() {
    grpc::ClientContext context;
    context.set_deadline(system_clock::now() + seconds(20));
    v1::GetServerInfoResponse reply;
    const grpc::Status status = maps_->GetServerInfo(&context, {}, &reply);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return status.ok();
  }

  // A client that calls continuously on one connection and must always be answered.
  void BeginBystander() {
    bystander_ = std::thread([this] {
      while (!stop_ && AskInfo()) ++answered_count_;
    });
  }
  void EndBystander() {
    const int before = answered_count_;
    // It must still be answered now.
    while (answered_count_ < before + 10 && bystander_.joinable() && !HasFailure()) {
      std::this_thread::sleep_for(milliseconds(1));
    }
    stop_ = true;
    bystander_.join();
  }

  test::TempFolder folder_;
  std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::MapService::Stub> maps_;
  std::atomic<bool> stop_{false};
  std::atomic<int> answered_count_{0};
  std::thread bystander_;
};

TEST_F(Hostile, AFloodOfResetsEndsItsOwnConnection) {
  Start();
  BeginBystander();
  Peak peak;
  test::RawHttp2 flooder(server_->address());
  ASSERT_TRUE(flooder.SendPreface());
  const int sent = test::FloodWithResets(&flooder, kLocate, 150'000);
  EXPECT_TRUE(sent < 150'000 || flooder.IsClosedWithin(seconds(10)));
  EndBystander();
  EXPECT_LT(peak.Growth(), 300 * kMebibyte);
}

TEST_F(Hostile, AFloodOfWholeRequestsThatAreResetEndsItsOwnConnectionToo) {
  Start();
  BeginBystander();
  Peak peak;
  test::RawHttp2 flooder(server_->address());
  ASSERT_TRUE(flooder.SendPreface());
  bool is_open = true;
  for (uint32_t stream = 1; stream < 200'000 && is_open; stream += 2) {
    is_open =
        flooder.Send(test::CallFrame(stream, kLocate) +
                     test::DataFrame(stream, test::MessagePrefix(0)) + test::ResetFrame(stream));
  }
  EndBystander();
  EXPECT_LT(peak.Growth(), 300 * kMebibyte);
}

TEST_F(Hostile, AFewResetsAreForgiven) {
  Start();
  test::RawHttp2 client(server_->address());
  ASSERT_TRUE(client.SendPreface());
  EXPECT_EQ(test::FloodWithResets(&client, kLocate, 300), 300);
  EXPECT_FALSE(client.IsClosedWithin(milliseconds(300)));
}

TEST_F(Hostile, EmptyNodesAreRefusedBeforeTheyAreParsed) {
  Start();
  const grpc::ByteBuffer nodes = EmptyNodes();
  BeginBystander();
  Peak peak;
  std::vector<std::unique_ptr<BytesCall>> calls;
  for (int i = 0; i < 8; ++i) {
    calls.push_back(std::make_unique<BytesCall>(server_->address(), kCommit, nodes));
  }
  for (const auto& call : calls) {
    EXPECT_EQ(call->Wait().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(call->reason(), v1::LIMIT_EXCEEDED);
  }
  EndBystander();
  // Parsing one of them would take 650 MB.
  EXPECT_LT(peak.Growth(), 200 * kMebibyte);
}

TEST_F(Hostile, ALongRequestIsRefusedLateAndAShortOneAtOnce) {
  Start();
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [begin] { return std::chrono::steady_clock::now() - begin; };
  BytesCall long_call(server_->address(), kCommit, EmptyNodes());
  BytesCall long_stream(server_->address(), "/dsg.v1.QueryService/GetMesh", EmptyNodes());
  const grpc::Slice slice("\xff\xff\xff");
  EXPECT_FALSE(BytesCall(server_->address(), kLocate, {&slice, 1}).Wait().ok());
  EXPECT_LT(elapsed(), seconds(1));
  EXPECT_TRUE(AskInfo());
  EXPECT_FALSE(long_stream.Wait().ok());
  EXPECT_GT(elapsed(), milliseconds(3500));
  EXPECT_EQ(long_call.Wait().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_GT(elapsed(), milliseconds(3500));
}

TEST_F(Hostile, AStreamWhoseRefusalWaitsTakesNoPlaceOfAnother) {
  ServerOptions options;
  options.open_stream_max = 1;
  Start(options);
  BytesCall long_stream(server_->address(), "/dsg.v1.QueryService/GetMesh", EmptyNodes());
  std::this_thread::sleep_for(milliseconds(500));
  const grpc::Slice nothing("");
  BytesCall short_stream(server_->address(), "/dsg.v1.QueryService/GetMesh", {&nothing, 1});
  EXPECT_FALSE(short_stream.Wait().ok());
  EXPECT_NE(short_stream.reason(), v1::OVERLOADED);
  EXPECT_FALSE(long_stream.Wait().ok());
}

TEST_F(Hostile, AServerThatStopsWaitsForNoRefusal) {
  Start();
  BytesCall call(server_->address(), kCommit, EmptyNodes());
  std::this_thread::sleep_for(milliseconds(500));
  const auto begin = std::chrono::steady_clock::now();
  server_->Shutdown(seconds(10));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(1));
  EXPECT_EQ(call.Wait().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST(ConnectionsTest, RefusesLongRequestsOfOneConnectionOneAfterAnother) {
  ConnectionLimits limits;
  limits.refused_bytes_per_s = 1e6;
  const Connections connections(limits);
  Connection one;
  Connection other;
  const auto now = std::chrono::steady_clock::now();
  const auto first = connections.RefusalDue(&one, 2'000'000);
  EXPECT_GE(first, now + seconds(2));
  EXPECT_EQ(connections.RefusalDue(&one, 500'000), first + milliseconds(500));
  EXPECT_LT(connections.RefusalDue(&other, 500'000), first);
  for (int i = 0; i < 20; ++i) connections.RefusalDue(&one, 2'000'000);
  const auto last = connections.RefusalDue(&one, 2'000'000);
  EXPECT_LE(last, std::chrono::steady_clock::now() + limits.refusal_pause_max);
}

TEST_F(Hostile, RequestsThatWaitForAWorkerHoldNoMoreThanTheirBytes) {
  ServerOptions options;
  options.worker_count = 2;
  Start(options);
  std::vector<std::future<grpc::Status>> held;
  for (int i = 0; i < 2; ++i) {
    held.push_back(std::async(std::launch::async, [this] {
      grpc::ClientContext context;
      context.set_deadline(system_clock::now() + seconds(60));
      v1::ListMapsResponse reply;
      return maps_->ListMaps(&context, {}, &reply);
    }));
  }
  gate_->WaitForRunning(2);
  const grpc::ByteBuffer paths = EmptyPaths();
  Peak peak;
  std::vector<std::unique_ptr<BytesCall>> calls;
  for (int i = 0; i < 32; ++i) {
    calls.push_back(std::make_unique<BytesCall>(server_->address(), kPlanPaths, paths));
  }
  // The queue fills up; the other calls are refused meanwhile.
  while (server_->Load().queued_count < 14) std::this_thread::sleep_for(milliseconds(1));
  std::this_thread::sleep_for(milliseconds(200));
  gate_->Open();
  for (auto& call : held) EXPECT_TRUE(call.get().ok());
  int overloaded_count = 0;
  for (const auto& call : calls) {
    EXPECT_EQ(call->Wait().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    if (call->reason() == v1::OVERLOADED) ++overloaded_count;
  }
  EXPECT_GT(overloaded_count, 8);
  EXPECT_LT(peak.Growth(), 400 * kMebibyte);
  EXPECT_TRUE(AskInfo());
}

TEST_F(Hostile, RequestsThatNeverEndGiveWayToOthers) {
  Start();
  BeginBystander();
  std::vector<std::unique_ptr<test::RawHttp2>> clients;
  for (int i = 0; i < 4; ++i) {
    clients.push_back(std::make_unique<test::RawHttp2>(server_->address()));
    ASSERT_TRUE(clients.back()->SendPreface());
    for (uint32_t call = 0; call < 60; ++call) {
      const uint32_t stream = 2 * call + 1;
      ASSERT_TRUE(clients.back()->Send(
          test::CallFrame(stream, kLocate) +
          test::DataFrame(stream, test::MessagePrefix(1 << 20) + std::string(100, 'x'))));
    }
  }
  EndBystander();
}

TEST_F(Hostile, BytesThatAreNoRequestAreCalledSo) {
  Start();
  const std::string bytes = "\xff\xff\xff";
  const grpc::Slice slice(bytes);
  BytesCall call(server_->address(), kLocate, grpc::ByteBuffer(&slice, 1));
  EXPECT_EQ(call.Wait().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.reason(), v1::FIELD_INVALID);
}

TEST_F(Hostile, ConnectionsBeyondTheBoundAreClosedAndThePlaceOfADeadOneIsTaken) {
  ServerOptions options;
  // One for the fixture's own connection.
  options.connection_max = 2;
  Start(options);
  auto second = std::make_unique<test::RawHttp2>(server_->address());
  ASSERT_TRUE(second->SendPreface());
  EXPECT_FALSE(second->IsClosedWithin(milliseconds(100)));
  test::RawHttp2 third(server_->address());
  third.SendPreface();
  EXPECT_TRUE(third.IsClosedWithin(seconds(10)));
  EXPECT_TRUE(AskInfo());
  second = nullptr;
  bool is_let_in = false;
  const auto give_up = std::chrono::steady_clock::now() + seconds(10);
  while (!is_let_in && std::chrono::steady_clock::now() < give_up) {
    test::RawHttp2 later(server_->address());
    later.SendPreface();
    is_let_in = !later.IsClosedWithin(milliseconds(50));
  }
  EXPECT_TRUE(is_let_in);
}

}  // namespace
}  // namespace dsg::server
