// SPDX-License-Identifier: Apache-2.0
// One recording in files of several kinds is one log.
#include <gtest/gtest.h>

#include <filesystem>

#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/depth/made_scan.h"
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

  absl::StatusOr<IngestSummary> Ingest(const std::string& path, const std::string& map,
                                       const LogOptions& options = {}) {
    MapSpec spec;
    spec.name = map;
    const absl::Status made = store_->CreateMap(spec);
    EXPECT_TRUE(made.ok() || ReasonOf(made) == Reason::kMapExists) << made;
    DSG_ASSIGN_OR_RETURN(const auto log, OpenLog(path, options));
    DSG_ASSIGN_OR_RETURN(const auto writer, store_->OpenWriter(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store_->OpenMap(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader->Latest());
    return IngestLog(*log, options, {.poses_per_delta = 3}, *MakeSnapshotMapView(latest, reader),
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

TEST_F(Recordings, AreOtherLogsOnlyIfOtherTopicsAreRead) {
  ASSERT_TRUE(Ingest(paths_[0], "office").ok());
  LogOptions options;
  options.topics = {{"imu0", "/tesse/imu/noisy/imu"}, {"truth", "/tesse/odom"}};
  EXPECT_TRUE(Ingest(paths_[0], "office", options)->was_known) << "as without the names";
  options.topics = {{"imu0", kNoTopic}};
  const auto without = Ingest(paths_[0], "lab", options);
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_NE(HeadOf("lab").session_id, HeadOf("office").session_id);
}

// A robot turns in a room; a lidar of 16 beams stands 0.6 m above its body.
TEST(Lidar, MakesTheMeshOfARoom) {
  Recording recording;
  for (int i = 0; i <= 20; ++i) {
    const TimeNs t = kT0 + TimeNs{i} * 100'000'000;
    Pose3d map_T_lidar;
    map_T_lidar.position = {0.05 * i, 1.0, 1.1 + 0.01 * i};
    const double half_turn = 0.05 * i;
    map_T_lidar.orientation = Eigen::Quaterniond(std::cos(half_turn), 0, 0, std::sin(half_turn));
    std::vector<std::array<float, 3>> points;
    for (const Eigen::Vector3f& point : MadeScan(map_T_lidar)) {
      points.push_back({point.x(), point.y(), point.z()});
    }
    recording.push_back({"/points", "sensor_msgs/PointCloud2", t,
                         CloudFields(CdrWriter(), t, "base_link", points)});
    recording.push_back({"/odom", "nav_msgs/Odometry", t,
                         OdometryFields(CdrWriter(), t,
                                        {0.05 * i, 1.0, 1.1 + 0.01 * i, 0, 0, std::sin(half_turn),
                                         std::cos(half_turn)})});
  }
  const TempFolder folder;
  const auto store = *OpenStore("memory:lidar", {.create = true});
  MapSpec spec;
  spec.name = "room";
  ASSERT_TRUE(store->CreateMap(spec).ok());
  const auto log = OpenLog(folder.Write("scans.mcap", WriteMcap(recording)), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const std::shared_ptr<MapReader> reader = *store->OpenMap("room");
  const auto writer = *store->OpenWriter("room");
  const auto view = MakeSnapshotMapView(*reader->Latest(), reader);
  IngestOptions options;
  options.mapping.volume.range_m = 8.0;
  const auto summary = IngestLog(**log, {}, options, *view, *writer, {});
  ASSERT_TRUE(summary.ok()) << summary.status();
  ASSERT_TRUE(summary->mapping.has_value());
  // Four sides a scan.
  EXPECT_EQ(summary->mapping->volume.frame_count, 4 * 21);
  const auto latest = *reader->Latest();
  int64_t vertex_count = 0, off_count = 0;
  Box3d seen;
  const std::vector<BlockIndex> indices = *latest->MeshBlocks();
  for (const BlockIndex& index : indices) {
    const MeshBlock block = *latest->ReadMeshBlock(index);
    for (const Eigen::Vector3f& vertex : block.positions_map) {
      ++vertex_count;
      seen.extend(vertex.cast<double>());
      if (OffSurface(vertex.cast<double>()) > 0.06) ++off_count;
    }
  }
  EXPECT_GT(vertex_count, 2000);
  EXPECT_LT(off_count, 0.02 * static_cast<double>(vertex_count)) << vertex_count;
  EXPECT_GT(seen.sizes().x(), 6.8);
  EXPECT_GT(seen.sizes().y(), 6.8);
}

}  // namespace
}  // namespace dsg::ingest
