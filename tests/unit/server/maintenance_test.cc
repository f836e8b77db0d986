// SPDX-License-Identifier: Apache-2.0
// Maintenance over the wire: streams that run next to commits and queries, and end with the caller,
// the map or the server.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/maintenance_service.grpc.pb.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using test::kMap;

// A compaction that never ends and reports progress as fast as it is read.
class EndlessCompaction final : public query::StreamCursor<v1::CompactResponse> {
 public:
  explicit EndlessCompaction(std::atomic<int>* open_count) : open_count_(open_count) {
    ++*open_count_;
  }
  ~EndlessCompaction() override { --*open_count_; }
  absl::StatusOr<bool> Next(const query::CallContext& call, v1::CompactResponse* reply) override {
    reply->set_progress(0.5);
    DSG_RETURN_IF_ERROR(call.Check());
    return true;
  }

 private:
  std::atomic<int>* const open_count_;
};

class EndlessCore final : public PassingCore {
 public:
  EndlessCore(std::unique_ptr<query::ServiceCore> core, std::atomic<int>* open_count)
      : PassingCore(std::move(core)), open_count_(open_count) {}
  query::CursorOr<v1::CompactResponse> Compact(const query::CallContext&,
                                               const v1::CompactRequest&) override {
    return std::make_unique<EndlessCompaction>(open_count_);
  }

 private:
  std::atomic<int>* const open_count_;
};

class MaintenanceRpc : public testing::Test {
 protected:
  MaintenanceRpc() { test::MakeOffice(folder_.path()); }

  void Start(std::unique_ptr<query::ServiceCore> core, ServerOptions options = {}) {
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.worker_count = 2;
    auto server = Server::Start(std::move(core), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    stub_ = v1::MaintenanceService::NewStub(channel_);
  }

  bool AnswersQuestions() {
    grpc::ClientContext context;
    v1::GetMapStatsRequest request;
    request.set_map(kMap);
    v1::GetMapStatsResponse reply;
    return v1::MapService::NewStub(channel_)->GetMapStats(&context, request, &reply).ok();
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::MaintenanceService::Stub> stub_;
};

TEST_F(MaintenanceRpc, TagsAndCompactionAndRevertAnswer) {
  Start(test::OpenCore(folder_.path()));
  {
    grpc::ClientContext context;
    v1::SetTagRequest request;
    request.set_map(kMap);
    request.set_name("start");
    v1::SetTagResponse reply;
    const grpc::Status status = stub_->SetTag(&context, request, &reply);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(reply.tag().revision(), 1);
  }
  {
    grpc::ClientContext context;
    v1::RevertRequest request;
    request.set_map(kMap);
    request.set_tag("start");
    const auto reader = stub_->Revert(&context, request);
    v1::RevertResponse message;
    while (reader->Read(&message)) {
    }
    EXPECT_TRUE(reader->Finish().ok());
    EXPECT_TRUE(message.done());
  }
  grpc::ClientContext context;
  v1::CompactRequest request;
  request.set_map(kMap);
  const auto reader = stub_->Compact(&context, request);
  v1::CompactResponse message;
  while (reader->Read(&message)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(message.done());
  EXPECT_EQ(message.oldest_revision(), 1);
}

TEST_F(MaintenanceRpc, ErrorsCarryTheirReason) {
  Start(test::OpenCore(folder_.path()));
  grpc::ClientContext context;
  v1::ReadArchiveRequest request;
  request.set_map("attic");
  const auto reader = stub_->ReadArchive(&context, request);
  v1::ReadArchiveResponse message;
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(DetailOf(context).reason(), v1::MAP_UNKNOWN);
}

TEST_F(MaintenanceRpc, AnArchiveComesWhole) {
  Start(test::OpenCore(folder_.path()));
  grpc::ClientContext context;
  v1::ReadArchiveRequest request;
  request.set_map(kMap);
  const auto reader = stub_->ReadArchive(&context, request);
  v1::ReadArchiveResponse message;
  std::string bytes;
  while (reader->Read(&message)) bytes += message.content();
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(message.progress(), 1.0);
  EXPECT_EQ(bytes.substr(bytes.size() - 40, 4), "DSGE");
}

// More messages than a connection buffers for a reader that does not read.
GraphDelta DeltaWithALargeAsset() {
  Random random(1, 0);
  Asset asset;
  asset.media_type = "application/octet-stream";
  for (int i = 0; i < 4'000'000; ++i) {
    asset.content.push_back(static_cast<char>(random.Integer(0, 255)));
  }
  asset.sha256 = ComputeSha256(asset.content);
  GraphDelta delta;
  delta.assets = {asset};
  return delta;
}

TEST_F(MaintenanceRpc, ArchivesThatNobodyReadsLeaveRoomForOtherWork) {
  test::CommitToOffice(folder_.path(), DeltaWithALargeAsset());
  constexpr int kStreamCount = 40;
  Start(test::OpenCore(folder_.path()), {.open_stream_max = 32});
  // The client buffers as little as possible.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  channel_ =
      grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments);
  stub_ = v1::MaintenanceService::NewStub(channel_);
  v1::ReadArchiveRequest request;
  request.set_map(kMap);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::ReadArchiveResponse>>> readers;
  for (int i = 0; i < kStreamCount; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    readers.push_back(stub_->ReadArchive(contexts.back().get(), request));
    // The stream has been opened or refused.
    readers.back()->WaitForInitialMetadata();
  }
  // A refused stream counts until the server has finished it.
  grpc::Status compacted;
  do {
    grpc::ClientContext context;
    v1::CompactRequest compact;
    compact.set_map(kMap);
    const auto reader = stub_->Compact(&context, compact);
    v1::CompactResponse message;
    while (reader->Read(&message)) {
    }
    compacted = reader->Finish();
  } while (compacted.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(compacted.ok()) << compacted.error_message();
  int refused_count = 0;
  for (size_t i = 0; i < readers.size(); ++i) {
    v1::ReadArchiveResponse message;
    while (readers[i]->Read(&message)) {
    }
    if (readers[i]->Finish().error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED) ++refused_count;
  }
  EXPECT_EQ(refused_count, kStreamCount - query::ArchiveLimits().count_max);
}

TEST_F(MaintenanceRpc, LongWorkLetsQuestionsPassAndEndsWithItsCaller) {
  std::atomic<int> open_count = 0;
  Start(std::make_unique<EndlessCore>(test::OpenCore(folder_.path()), &open_count));
  grpc::ClientContext contexts[3];
  std::unique_ptr<grpc::ClientReader<v1::CompactResponse>> readers[3];
  v1::CompactResponse message;
  for (int i = 0; i < 3; ++i) {
    readers[i] = stub_->Compact(&contexts[i], v1::CompactRequest());
    EXPECT_TRUE(readers[i]->Read(&message));
  }
  EXPECT_EQ(open_count, 3);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(AnswersQuestions());
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 100; ++k) EXPECT_TRUE(readers[i]->Read(&message));
    contexts[i].TryCancel();
    while (readers[i]->Read(&message)) {
    }
    EXPECT_EQ(readers[i]->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  server_->Shutdown(std::chrono::seconds(5));
  EXPECT_EQ(open_count, 0);
}

TEST_F(MaintenanceRpc, AServerThatStopsEndsWorkAndSaysSo) {
  std::atomic<int> open_count = 0;
  Start(std::make_unique<EndlessCore>(test::OpenCore(folder_.path()), &open_count));
  grpc::ClientContext context;
  const auto reader = stub_->Compact(&context, v1::CompactRequest());
  v1::CompactResponse message;
  ASSERT_TRUE(reader->Read(&message));
  std::thread stopper([&] { server_->Shutdown(std::chrono::seconds(20)); });
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(DetailOf(context).reason(), v1::SHUTTING_DOWN);
  stopper.join();
  EXPECT_EQ(open_count, 0);
}

}  // namespace
}  // namespace dsg::server
