// SPDX-License-Identifier: Apache-2.0
// DropMap and RenameMap, with readers, writers, watches and archives of the map under way.
#include <gtest/gtest.h>

#include <filesystem>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

class WholeMapCalls : public testing::Test {
 protected:
  WholeMapCalls() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  absl::StatusOr<v1::DropMapResponse> Drop(const v1::DropMapRequest& request) {
    v1::DropMapResponse reply;
    DSG_RETURN_IF_ERROR(core_->DropMap(call_, request, &reply));
    return reply;
  }
  absl::Status Drop(const std::string& map) {
    v1::DropMapRequest request;
    request.set_map(map);
    return Drop(request).status();
  }
  absl::StatusOr<v1::RenameMapResponse> Rename(const std::string& from, const std::string& to) {
    v1::RenameMapRequest request;
    request.set_map(from);
    request.set_new_name(to);
    v1::RenameMapResponse reply;
    DSG_RETURN_IF_ERROR(core_->RenameMap(call_, request, &reply));
    return reply;
  }
  absl::StatusOr<v1::GetMapStatsResponse> Stats(const std::string& map) {
    v1::GetMapStatsRequest request;
    request.set_map(map);
    v1::GetMapStatsResponse reply;
    DSG_RETURN_IF_ERROR(core_->GetMapStats(call_, request, &reply));
    return reply;
  }
  absl::Status Create(const std::string& map) {
    v1::CreateMapRequest request;
    MapSpec spec;
    spec.name = map;
    ToProto(spec, request.mutable_map());
    v1::CreateMapResponse reply;
    return core_->CreateMap(call_, request, &reply);
  }
  // One more pose of the robot, by a session that goes on.
  absl::Status Commit(const std::string& map) {
    GraphDelta delta;
    delta.map = map;
    delta.session_id = "robot";
    delta.sequence = ++sequence_;
    delta.appends = {{NodeId('r', 1), {PoseAt((10 + sequence_) * kSecond, 1, 2, 0)}}};
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    v1::CommitResponse reply;
    return core_->Commit(call_, request, &reply);
  }
  absl::StatusOr<v1::GetNodeResponse> GetCup(const std::string& map) {
    v1::GetNodeRequest request;
    request.set_map(map);
    request.set_id("O1");
    v1::GetNodeResponse reply;
    DSG_RETURN_IF_ERROR(core_->GetNode(call_, request, &reply));
    return reply;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
  int64_t sequence_ = 0;
};

// Files of the store's folder that this process holds open, though no name is left of them.
int OpenFileCount(const std::string& folder) {
  int count = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    const std::string target = fs::read_symlink(entry.path(), error).string();
    if (target.rfind(folder, 0) == 0 && target.find("(deleted)") != std::string::npos) ++count;
  }
  return count;
}

TEST_F(WholeMapCalls, ADroppedMapIsUnknownAndItsFilesAreGone) {
  // Read and written by this very process, which holds the lock.
  ASSERT_EQ(Commit(kMap), absl::OkStatus());
  ASSERT_TRUE(GetCup(kMap).ok());
  v1::DropMapRequest request;
  request.set_map(kMap);
  const auto dropped = Drop(request);
  ASSERT_TRUE(dropped.ok()) << dropped.status();
  EXPECT_EQ(dropped->head_revision(), 2);
  EXPECT_GT(dropped->bytes_on_disk(), 10'000);
  EXPECT_EQ(ReasonOf(GetCup(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(Commit(kMap)), Reason::kMapUnknown);
  EXPECT_EQ(ReasonOf(Drop(kMap)), Reason::kMapUnknown);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  EXPECT_EQ(OpenFileCount(folder_.path()), 0);
}

TEST_F(WholeMapCalls, AMapOfTheSameNameIsAnotherOne) {
  ASSERT_TRUE(GetCup(kMap).ok());
  ASSERT_EQ(Commit(kMap), absl::OkStatus());
  const std::string before = Stats(kMap)->header().incarnation();
  ASSERT_EQ(Drop(kMap), absl::OkStatus());
  ASSERT_EQ(Create(kMap), absl::OkStatus());
  EXPECT_EQ(ReasonOf(GetCup(kMap).status()), Reason::kNodeUnknown);
  EXPECT_EQ(Stats(kMap)->head_revision(), 0);
  EXPECT_NE(Stats(kMap)->header().incarnation(), before);
  // A session that wrote the old one has no place here.
  EXPECT_EQ(ReasonOf(Commit(kMap)), Reason::kSequenceGap);
}

TEST_F(WholeMapCalls, ADropIsOfTheMapThatIsExpected) {
  v1::DropMapRequest request;
  request.set_map(kMap);
  request.set_expected_head_revision(1);
  request.set_expected_incarnation(Stats(kMap)->header().incarnation());
  ASSERT_EQ(Commit(kMap), absl::OkStatus());
  EXPECT_EQ(ReasonOf(Drop(request).status()), Reason::kParentRevisionStale);
  request.set_expected_head_revision(2);
  request.set_expected_incarnation("another");
  EXPECT_EQ(ReasonOf(Drop(request).status()), Reason::kMapReplaced);
  request.set_expected_head_revision(-1);
  EXPECT_EQ(ReasonOf(Drop(request).status()), Reason::kFieldInvalid);
  // It is written on as before.
  EXPECT_EQ(Commit(kMap), absl::OkStatus());
  request.set_expected_head_revision(3);
  request.set_expected_incarnation(Stats(kMap)->header().incarnation());
  EXPECT_TRUE(Drop(request).ok());
}

TEST_F(WholeMapCalls, AnotherProcessThatWritesTheMapKeepsIt) {
  const auto store = GraphStore::Open(folder_.path(), {.program = "robot"});
  ASSERT_TRUE(store.ok()) << store.status();
  const auto writer = (*store)->OpenWriter(kMap);
  ASSERT_TRUE(writer.ok()) << writer.status();
  EXPECT_EQ(ReasonOf(Drop(kMap)), Reason::kWriterLocked);
  EXPECT_EQ(ReasonOf(Rename(kMap, "attic").status()), Reason::kWriterLocked);
  EXPECT_TRUE(GetCup(kMap).ok());
}

TEST_F(WholeMapCalls, AMapThatAnotherProcessDropsIsUnknownAndClosed) {
  ASSERT_TRUE(GetCup(kMap).ok());
  {
    const auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    ASSERT_TRUE((*store)->DropMap(kMap, {}).ok());
  }
  EXPECT_GT(OpenFileCount(folder_.path()), 0);
  EXPECT_EQ(ReasonOf(GetCup(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(OpenFileCount(folder_.path()), 0);
}

TEST_F(WholeMapCalls, WatchesOfAMapThatIsDroppedOrRenamedEnd) {
  for (const bool is_drop : {false, true}) {
    const std::string map = is_drop ? "attic" : kMap;
    v1::WatchMapRequest request;
    request.set_map(map);
    auto watch = core_->WatchMap(call_, request);
    ASSERT_TRUE(watch.ok()) << watch.status();
    v1::WatchMapResponse first;
    ASSERT_TRUE((*watch)->Next(call_, &first).ok());
    ASSERT_EQ(is_drop ? Drop(map) : Rename(map, "attic").status(), absl::OkStatus());
    EXPECT_EQ((*watch)->Wait().count(), 0);
    v1::WatchMapResponse next;
    EXPECT_EQ(ReasonOf((*watch)->Next(call_, &next).status()), Reason::kMapReplaced);
  }
}

TEST_F(WholeMapCalls, ArchivesOfADroppedMapEndAndTheirCopiesGo) {
  v1::ReadArchiveRequest request;
  request.set_map(kMap);
  auto archive = core_->ReadArchive(call_, request);
  ASSERT_TRUE(archive.ok()) << archive.status();
  ASSERT_EQ(Drop(kMap), absl::OkStatus());
  v1::ReadArchiveResponse piece;
  EXPECT_EQ(ReasonOf((*archive)->Next(call_, &piece).status()), Reason::kMapReplaced);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(WholeMapCalls, ARenamedMapIsReadAndWrittenOn) {
  ASSERT_EQ(Commit(kMap), absl::OkStatus());
  const auto renamed = Rename(kMap, "attic");
  ASSERT_TRUE(renamed.ok()) << renamed.status();
  EXPECT_EQ(renamed->map().name(), "attic");
  EXPECT_EQ(GetCup("attic")->node().name(), "cup");
  EXPECT_EQ(ReasonOf(GetCup(kMap).status()), Reason::kMapUnknown);
  // The session goes on where it is, and not where it was.
  EXPECT_EQ(ReasonOf(Commit(kMap)), Reason::kMapUnknown);
  --sequence_;
  EXPECT_EQ(Commit("attic"), absl::OkStatus());
  EXPECT_EQ(Stats("attic")->head_revision(), 3);
}

TEST_F(WholeMapCalls, ARenamingIsRefusedWithTheMapAsItWas) {
  ASSERT_EQ(Create("attic"), absl::OkStatus());
  EXPECT_EQ(ReasonOf(Rename(kMap, "attic").status()), Reason::kMapExists);
  EXPECT_EQ(ReasonOf(Rename(kMap, "no/name").status()), Reason::kMapNameInvalid);
  EXPECT_EQ(ReasonOf(Rename("nowhere", "lab").status()), Reason::kMapUnknown);
  EXPECT_TRUE(GetCup(kMap).ok());
  EXPECT_EQ(Commit(kMap), absl::OkStatus());
}

TEST_F(WholeMapCalls, NamesThatNobodyHasAreForgotten) {
  // Each of them would stay in a table of writers.
  for (int i = 0; i < 100; ++i) {
    const std::string name = "map-" + std::to_string(i);
    EXPECT_EQ(ReasonOf(Drop(name)), Reason::kMapUnknown);
    ASSERT_EQ(Create(name), absl::OkStatus());
    ASSERT_EQ(Drop(name), absl::OkStatus());
  }
  EXPECT_EQ(OpenFileCount(folder_.path()), 0);
}

TEST_F(WholeMapCalls, AMapThatCannotBeReadIsDroppedUnlessItIsExpectedToBeSomething) {
  fs::resize_file(folder_.path() + "/office/graph.db", 4096);
  EXPECT_FALSE(GetCup(kMap).ok());
  v1::DropMapRequest request;
  request.set_map(kMap);
  request.set_expected_head_revision(1);
  EXPECT_FALSE(Drop(request).ok());
  request.clear_expected_head_revision();
  const auto dropped = Drop(request);
  ASSERT_TRUE(dropped.ok()) << dropped.status();
  EXPECT_FALSE(dropped->has_head_revision());
}

}  // namespace
}  // namespace dsg::test
