// SPDX-License-Identifier: Apache-2.0
// One recording in files of several kinds is one log.
#include <gtest/gtest.h>

#include <filesystem>

#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {
namespace {

class Recordings : public testing::Test {
 protected:
  void SetUp() override {
    const Recording cdr = SmallRecording(CdrWriter(), 8);
    std::filesystem::create_directories(folder_.Path("db3"));
    WriteDb3(cdr, folder_.Path("db3/run.db3"));
    paths_ = {folder_.Write("ros1/run.bag", WriteBag(SmallRecording(ByteWriter(), 8))),
              folder_.Write("mcap/run.mcap", WriteMcap(cdr)), folder_.Path("db3/run.db3")};
    store_ = *OpenStore("memory:recordings", {.create = true});
  }

  absl::StatusOr<IngestSummary> Ingest(const std::string& path, const std::string& map) {
    MapSpec spec;
    spec.name = map;
    const absl::Status made = store_->CreateMap(spec);
    EXPECT_TRUE(made.ok() || ReasonOf(made) == Reason::kMapExists) << made;
    DSG_ASSIGN_OR_RETURN(const auto log, OpenLog(path, {}));
    DSG_ASSIGN_OR_RETURN(const auto writer, store_->OpenWriter(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store_->OpenMap(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader->Latest());
    return IngestLog(*log, {}, {.poses_per_delta = 3}, *MakeSnapshotMapView(latest, reader),
                     *writer, {});
  }
  RevisionInfo HeadOf(const std::string& map) { return *(*store_->OpenMap(map))->Head(); }

  TempFolder folder_;
  std::vector<std::string> paths_;
  std::unique_ptr<GraphStore> store_;
};

TEST_F(Recordings, GiveTheSameDigestsInEveryKindOfFile) {
  std::vector<RevisionInfo> heads;
  for (const std::string map : {"ros1", "mcap", "db3"}) {
    const auto summary = Ingest(paths_[heads.size()], map);
    ASSERT_TRUE(summary.ok()) << summary.status();
    heads.push_back(HeadOf(map));
  }
  EXPECT_GE(heads[0].revision, 2);
  EXPECT_EQ(heads[0].pose_count, 8);
  for (const RevisionInfo& head : heads) {
    EXPECT_EQ(head.revision, heads[0].revision);
    EXPECT_EQ(head.digest, heads[0].digest);
  }
}

TEST_F(Recordings, AddNothingToAMapThatHasThemInAnotherKindOfFile) {
  ASSERT_TRUE(Ingest(paths_[0], "office").ok());
  const RevisionInfo head = HeadOf("office");
  for (const std::string& path : paths_) {
    const auto again = Ingest(path, "office");
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_TRUE(again->was_known) << path;
  }
  EXPECT_EQ(HeadOf("office").digest, head.digest);
}

}  // namespace
}  // namespace dsg::ingest
