// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Maps : public testing::Test {
 protected:
  Maps() {
    MakeOffice(folder_.path());
    core_ = OpenCore(folder_.path());
  }

  absl::Status Create(const std::string& name) {
    v1::CreateMapRequest request;
    request.mutable_map()->set_name(name);
    return core_->CreateMap(call_, request, &created_);
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
  v1::CreateMapResponse created_;
};

TEST_F(Maps, CreatesAMapWithDefaultsAndListsItByName) {
  ASSERT_TRUE(Create("attic").ok());
  EXPECT_EQ(created_.map().frame(), "map");
  EXPECT_EQ(created_.map().codec(), v1::TRAJECTORY_CODEC_QUANTIZED);
  EXPECT_EQ(created_.map().gap_ns_max(), 2 * kSecond);
  v1::ListMapsResponse reply;
  ASSERT_TRUE(core_->ListMaps(call_, {}, &reply).ok());
  ASSERT_EQ(reply.maps_size(), 2);
  EXPECT_EQ(reply.maps(0).name(), "attic");
  EXPECT_EQ(reply.maps(1).name(), "office");
}

// Maps of which this process has a file open.
std::set<std::string> OpenMaps(const std::string& folder) {
  std::set<std::string> maps;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::string path = std::filesystem::read_symlink(entry.path(), error).string();
    if (error || path.rfind(folder + "/", 0) != 0) continue;
    maps.insert(std::filesystem::path(path).parent_path().filename().string());
  }
  return maps;
}

TEST_F(Maps, AreClosedWhenOthersWereAskedSince) {
  auto store = GraphStore::Open(folder_.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  core_ = query::MakeServiceCore(*std::move(store), {.open_maps_max = 2});
  for (int round = 1; round <= 2; ++round) {
    for (const std::string name : {"a", "b", "c", "d", "e"}) {
      if (round == 1) {
        ASSERT_TRUE(Create(name).ok());
      }
      v1::CommitRequest commit;
      commit.mutable_delta()->set_map(name);
      commit.mutable_delta()->set_session_id("test");
      commit.mutable_delta()->set_sequence(round);
      v1::CommitResponse committed;
      const absl::Status status = core_->Commit(call_, commit, &committed);
      ASSERT_TRUE(status.ok()) << status;
      v1::GetMapStatsRequest ask;
      ask.set_map(name);
      v1::GetMapStatsResponse stats;
      ASSERT_TRUE(core_->GetMapStats(call_, ask, &stats).ok());
      EXPECT_EQ(stats.head_revision(), round);
      const std::set<std::string> open = OpenMaps(std::filesystem::canonical(folder_.path()));
      EXPECT_TRUE(open.contains(name));
      EXPECT_LE(open.size(), 2u);
    }
  }
}

TEST_F(Maps, NamesThoseThatCannotBeOpened) {
  std::filesystem::create_directories(folder_.path() + "/cellar");
  std::ofstream(folder_.path() + "/cellar/graph.db") << "no database";
  v1::ListMapsResponse reply;
  ASSERT_TRUE(core_->ListMaps(call_, {}, &reply).ok());
  EXPECT_EQ(reply.maps_size(), 1);
  ASSERT_EQ(reply.unreadable_maps_size(), 1);
  EXPECT_EQ(reply.unreadable_maps(0), "cellar");
}

TEST_F(Maps, RefusesNamesThatExistOrArePaths) {
  EXPECT_EQ(ReasonOf(Create("office")), Reason::kMapExists);
  for (const char* name :
       {"", "../dsg-escaped", "/tmp/dsg-escaped", "a/b", "A", "a b", ".", "x\n"}) {
    EXPECT_EQ(ReasonOf(Create(name)), Reason::kMapNameInvalid) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/../dsg-escaped"));
}

TEST_F(Maps, MeasuresAMap) {
  v1::GetMapStatsRequest request;
  request.set_map(kMap);
  v1::GetMapStatsResponse reply;
  ASSERT_TRUE(core_->GetMapStats(call_, request, &reply).ok());
  EXPECT_EQ(reply.head_revision(), 1);
  EXPECT_EQ(reply.node_count(), 11);
  EXPECT_EQ(reply.edge_count(), 9);
  EXPECT_EQ(reply.agent_count(), 3);
  EXPECT_EQ(reply.pose_count(), 34);
  EXPECT_EQ(reply.stay_count(), 5);
  EXPECT_GT(reply.bytes_on_disk(), 0);
  EXPECT_EQ(reply.first_pose_ns(), 0);
  EXPECT_EQ(reply.last_pose_ns(), 62 * kSecond);
  EXPECT_EQ(reply.format_version(), kStoreFormatVersion);
  int64_t node_count = 0;
  for (const auto& layer : reply.layers()) node_count += layer.node_count();
  EXPECT_EQ(node_count, 11);
}

TEST_F(Maps, ListsRevisionsNewestFirstInPages) {
  for (int i = 0; i < 4; ++i) {
    GraphDelta delta;
    delta.message = "step " + std::to_string(i);
    delta.appends = {{NodeId('r', 1), {PoseAt((100 + i) * kSecond, 0, 0, 0)}}};
    CommitToOffice(folder_.path(), std::move(delta));
  }
  v1::ListRevisionsRequest request;
  request.set_map(kMap);
  request.set_page_size(2);
  std::vector<int64_t> seen;
  while (true) {
    v1::ListRevisionsResponse reply;
    ASSERT_TRUE(core_->ListRevisions(call_, request, &reply).ok());
    if (reply.revisions().empty()) break;
    EXPECT_LE(reply.revisions_size(), 2);
    for (const auto& revision : reply.revisions()) seen.push_back(revision.revision());
    request.set_before_revision(seen.back());
    if (seen.back() <= 1) break;
  }
  EXPECT_EQ(seen, (std::vector<int64_t>{5, 4, 3, 2, 1}));
  request.set_before_revision(-1);
  v1::ListRevisionsResponse reply;
  EXPECT_EQ(ReasonOf(core_->ListRevisions(call_, request, &reply)), Reason::kFieldInvalid);
}

TEST_F(Maps, SaysWhatIsRunning) {
  v1::GetServerInfoResponse reply;
  ASSERT_TRUE(core_->GetServerInfo(call_, {}, &reply).ok());
  EXPECT_FALSE(reply.version().empty());
  EXPECT_EQ(reply.store_format_version(), kStoreFormatVersion);
}

}  // namespace
}  // namespace dsg::test
