// SPDX-License-Identifier: Apache-2.0
// Readers of a large mesh that do not read, vanish or cancel must not occupy workers or memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "schema/base/random.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;

class SlowReader : public testing::Test {
 protected:
  SlowReader() {
    test::MakeOffice(folder_.path());
    test::CommitToOffice(folder_.path(), MeshDelta());
  }

  void Start(int open_stream_max) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.worker_count = 1;
    options.open_stream_max = open_stream_max;
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    maps_ = v1::MapService::NewStub(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  grpc::Status AskInfo() {
    grpc::ClientContext context;
    context.set_deadline(system_clock::now() + seconds(10));
    v1::GetServerInfoResponse reply;
    return maps_->GetServerInfo(&context, {}, &reply);
  }

  // The server may notice the departure of a reader a little later.
  bool IsLetIn() {
    for (int i = 0; i < 2000; ++i) {
      MeshReader reader(server_->address());
      v1::GetMeshResponse reply;
      if (reader.Read(&reply)) return true;
    }
    return false;
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::MapService::Stub> maps_;
};

TEST_F(SlowReader, GetsEveryBlockOnceAndInOrderHoweverSlow) {
  Start(4);
  MeshReader reader(server_->address());
  v1::GetMeshResponse reply;
  std::vector<std::pair<int, int>> blocks;
  int message_count = 0;
  while (reader.Read(&reply)) {
    EXPECT_EQ(reply.has_header(), message_count++ == 0);
    for (const v1::MeshBlock& block : reply.blocks()) {
      EXPECT_EQ(block.positions_size(), 3 * static_cast<int>(kMeshVertexCount));
      blocks.emplace_back(block.x(), block.y());
    }
    if (message_count % 8 == 0) {
      ASSERT_TRUE(AskInfo().ok());
    }
  }
  EXPECT_TRUE(reader.Finish().ok());
  EXPECT_EQ(blocks.size(), static_cast<size_t>(kMeshBlockCount));
  EXPECT_TRUE(std::is_sorted(blocks.begin(), blocks.end()));
  EXPECT_EQ(std::adjacent_find(blocks.begin(), blocks.end()), blocks.end());
}

TEST_F(SlowReader, LeavesTheOnlyWorkerAndTheMemoryToOthers) {
  constexpr int kReaderCount = 12;
  constexpr int64_t kBytesPerReaderMax = 12 << 20;
  Start(kReaderCount);
  ASSERT_TRUE(AskInfo().ok());
  const int64_t before = ResidentBytes();
  std::vector<std::unique_ptr<MeshReader>> readers;
  v1::GetMeshResponse reply;
  for (int i = 0; i < kReaderCount; ++i) {
    readers.push_back(std::make_unique<MeshReader>(server_->address()));
    ASSERT_TRUE(readers.back()->Read(&reply));
  }
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(AskInfo().ok());
  // Both ends are in this process. Each stream has 40 MB.
  EXPECT_LT(ResidentBytes() - before, kReaderCount * kBytesPerReaderMax);
}

TEST_F(SlowReader, GivesUpItsPlaceWhenItVanishes) {
  Start(1);
  {
    MeshReader first(server_->address());
    v1::GetMeshResponse reply;
    ASSERT_TRUE(first.Read(&reply));
    MeshReader second(server_->address());
    EXPECT_FALSE(second.Read(&reply));
    EXPECT_EQ(second.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  }
  EXPECT_TRUE(IsLetIn());
}

TEST_F(SlowReader, MayVanishAtAnyMoment) {
  Start(64);
  Random random(22, 0);
  for (int i = 0; i < 60; ++i) {
    MeshReader reader(server_->address());
    v1::GetMeshResponse reply;
    for (int left = random.Index(6); left > 0; --left) ASSERT_TRUE(reader.Read(&reply));
  }
  ASSERT_TRUE(AskInfo().ok());
  EXPECT_TRUE(IsLetIn());
}

}  // namespace
}  // namespace dsg::server
