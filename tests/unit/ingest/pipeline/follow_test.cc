// SPDX-License-Identifier: Apache-2.0
// Logs that are committed while they grow: stopped, killed and taken up, the map ends up the same.
#include <gtest/gtest.h>

#include <atomic>
#include <sstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/depth/made_scan.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

LogOptions FollowFor(milliseconds timeout, const std::atomic<bool>* stop = nullptr) {
  LogOptions options;
  options.follow = FollowOptions{.timeout = timeout, .stop = stop};
  return options;
}

class FollowTest : public testing::Test {
 protected:
  void SetUp() override {
    static int count = 0;
    store_ = *OpenStore(absl::StrCat("memory:follow", ++count), {.create = true});
  }

  // A map with two rooms, into which stays can be.
  void MakeRooms(const std::string& map) {
    MapSpec spec;
    spec.name = map;
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    GraphDelta world;
    world.map = map;
    world.session_id = "by hand";
    world.sequence = 1;
    world.nodes = {MakeRoom(1, -1, 0, 5, 9), MakeRoom(2, 5, 0, 20, 9)};
    const auto writer = *store_->OpenWriter(map);
    const auto made = writer->Commit(world);
    ASSERT_TRUE(made.ok()) << made.status();
  }

  // A name that is new is a new map.
  absl::StatusOr<IngestSummary> Ingest(const std::string& map, const std::string& path,
                                       const LogOptions& options, int commit_count_max = -1) {
    MapSpec spec;
    spec.name = map;
    const absl::Status made = store_->CreateMap(spec);
    EXPECT_TRUE(made.ok() || ReasonOf(made) == Reason::kMapExists) << made;
    DSG_ASSIGN_OR_RETURN(const auto log, OpenLog(path, options));
    DSG_ASSIGN_OR_RETURN(const auto own_writer, store_->OpenWriter(map));
    FragileWriter writer(*own_writer, commit_count_max);
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store_->OpenMap(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader->Latest());
    IngestOptions ingest_options;
    ingest_options.poses_per_delta = 7;
    ingest_options.mapping.volume.range_m = 8.0;
    return IngestLog(*log, options, ingest_options, *MakeSnapshotMapView(latest, reader), writer,
                     {});
  }

  RevisionInfo HeadOf(const std::string& map) { return *(*store_->OpenMap(map))->Head(); }

  std::vector<Node> NodesOf(const std::string& map, LayerId layer) {
    const std::shared_ptr<MapReader> reader = *store_->OpenMap(map);
    return *MakeSnapshotMapView(*reader->Latest(), reader)->NodesOfLayer(layer);
  }

  // Agents with their poses and stays, as text.
  std::string TracksOf(const std::string& map) {
    const auto latest = *(*store_->OpenMap(map))->Latest();
    std::ostringstream out;
    const std::vector<TrackInfo> tracks = *latest->Tracks();
    for (const TrackInfo& track : tracks) {
      const Node node = *latest->GetNode(track.agent);
      out << ToString(track.agent) << " " << track.name << " " << track.pose_count << " "
          << *node.first_observed_ns << " " << *node.last_observed_ns << " "
          << node.observation_count << "\n";
      EXPECT_TRUE(latest
                      ->ReadPoses(track.agent, kTimeMin, kTimeMax, {},
                                  [&](const TimedPose& pose) {
                                    out << pose.time_ns << " "
                                        << pose.map_T_agent.position.transpose() << "\n";
                                    return true;
                                  })
                      .ok());
      const std::vector<Stay> stays = *latest->StaysOfAgent(track.agent, kTimeMin, kTimeMax);
      for (const Stay& stay : stays) {
        out << "stay " << ToString(stay.room) << " " << stay.enter_ns << " " << stay.exit_ns
            << "\n";
      }
    }
    return out.str();
  }

  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};

std::string Rows(int from, int to) {
  std::string rows;
  for (int i = from; i < to; ++i) {
    for (const std::string agent : {"zoe", "bob", "eve"}) {
      absl::StrAppend(&rows, i, ".25,", agent, ",", 0.5 * i, ",", agent.size(), "\n");
    }
  }
  return rows;
}

const std::string kHeader = "time,id,x,y\n";

TEST_F(FollowTest, ATableIsCommittedWhileItGrows) {
  const std::string path = folder_.Write("log.csv", kHeader + Rows(0, 2));
  std::atomic<bool> stop = false;
  absl::StatusOr<IngestSummary> summary = absl::UnknownError("not run");
  std::thread run(
      [&] { summary = Ingest("office", path, FollowFor(milliseconds(60'000), &stop)); });
  const auto wait_for = [&](int64_t pose_count) {
    const auto begin = std::chrono::steady_clock::now();
    while (true) {
      const auto map = store_->OpenMap("office");
      if (map.ok() && (*(*map)->Head()).pose_count >= pose_count) break;
      if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(30)) break;
      std::this_thread::sleep_for(milliseconds(20));
    }
    return std::chrono::steady_clock::now() - begin;
  };
  EXPECT_LT(wait_for(6), std::chrono::seconds(5));
  for (int i = 2; i < 4; ++i) {
    std::ofstream(path, std::ios::app) << Rows(i, i + 1);
    // Nothing is promised to the millisecond: rows wait for others of their instant, and to be
    // committed.
    EXPECT_LT(wait_for(3 * (i + 1)), std::chrono::seconds(5));
  }
  stop = true;
  run.join();
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->is_paused);
  ASSERT_TRUE(Ingest("whole", path, {}).ok());
  EXPECT_EQ(TracksOf("office"), TracksOf("whole"));
}

TEST_F(FollowTest, ATableThatWasStoppedAnywhereGoesOn) {
  const std::string whole = folder_.Write("whole.csv", kHeader + Rows(0, 30));
  MakeRooms("whole");
  ASSERT_TRUE(Ingest("whole", whole, {}).ok());
  EXPECT_NE(TracksOf("whole").find("stay R2"), std::string::npos) << TracksOf("whole");
  for (const int cut : {1, 7, 29}) {
    for (const int commit_count_max : {0, 1, -1}) {
      const std::string map = absl::StrCat("cut", cut, "at", commit_count_max + 1);
      SCOPED_TRACE(map);
      MakeRooms(map);
      const std::string path = folder_.Write("log.csv", kHeader + Rows(0, cut));
      const auto first = Ingest(map, path, FollowFor(milliseconds(0)), commit_count_max);
      EXPECT_EQ(first.ok(), commit_count_max != 0 && !(commit_count_max == 1 && cut > 1));
      folder_.Write("log.csv", kHeader + Rows(0, 30));
      const auto rest = Ingest(map, path, FollowFor(milliseconds(0)));
      ASSERT_TRUE(rest.ok()) << rest.status();
      EXPECT_EQ(TracksOf(map), TracksOf("whole"));
      const Revision head = HeadOf(map).revision;
      ASSERT_TRUE(Ingest(map, path, FollowFor(milliseconds(0))).ok());
      ASSERT_TRUE(Ingest(map, whole, {}).ok());
      EXPECT_EQ(HeadOf(map).revision, head);
    }
  }
}

TEST_F(FollowTest, ATableOfOtherPosesIsRefused) {
  const std::string path = folder_.Write("log.csv", kHeader + Rows(0, 5));
  ASSERT_TRUE(Ingest("office", path, FollowFor(milliseconds(0))).ok());
  folder_.Write("log.csv", kHeader + Rows(0, 4) + "4.25,zoe,99,3\n");
  EXPECT_EQ(ReasonOf(Ingest("office", path, FollowFor(milliseconds(0))).status()),
            Reason::kTrackConflict);
}

// A robot with a lidar turns in a room, for eight seconds.
class FollowedRoom : public FollowTest {
 protected:
  static constexpr int kScanCount = 20;

  void SetUp() override {
    FollowTest::SetUp();
    Recording recording;
    for (int i = 0; i < kScanCount; ++i) {
      const TimeNs t = kT0 + TimeNs{i} * 400'000'000;
      const double half_turn = 0.1 * i;
      Pose3d map_T_lidar;
      map_T_lidar.position = {0.1 * i, 1.0, 1.1};
      map_T_lidar.orientation = Eigen::Quaterniond(std::cos(half_turn), 0, 0, std::sin(half_turn));
      std::vector<std::array<float, 3>> points;
      for (const Eigen::Vector3f& point : MadeScan(map_T_lidar)) {
        points.push_back({point.x(), point.y(), point.z()});
      }
      recording.push_back({"/points", "sensor_msgs/PointCloud2", t,
                           CloudFields(CdrWriter(), t, "base_link", points)});
      recording.push_back(
          {"/odom", "nav_msgs/Odometry", t,
           OdometryFields(CdrWriter(), t,
                          {0.1 * i, 1.0, 1.1, 0, 0, std::sin(half_turn), std::cos(half_turn)})});
    }
    bytes_ = WriteMcap(recording);
  }
  std::string Begin(double share) {
    const auto size = static_cast<size_t>(share * static_cast<double>(bytes_.size()));
    return folder_.Write("scans.mcap", bytes_.substr(0, size));
  }

  std::string bytes_;
};

TEST_F(FollowedRoom, EndsInTheSameMapHoweverOftenItWasStopped) {
  const auto whole = Ingest("whole", Begin(1.0), FollowFor(milliseconds(0)));
  ASSERT_TRUE(whole.ok()) << whole.status();
  ASSERT_TRUE(whole->mapping.has_value());
  const RevisionInfo expected = HeadOf("whole");
  EXPECT_GT(expected.revision, 6);
  EXPECT_EQ(expected.pose_count, kScanCount);
  // Stopped, with half of it and then with more.
  for (const double share : {0.5, 0.8}) {
    std::atomic<bool> stop = false;
    const std::string path = Begin(share);
    std::thread stopper([&] {
      std::this_thread::sleep_for(milliseconds(1500));
      stop = true;
    });
    const auto paused = Ingest("stopped", path, FollowFor(milliseconds(60'000), &stop));
    stopper.join();
    ASSERT_TRUE(paused.ok()) << paused.status();
    EXPECT_TRUE(paused->is_paused);
  }
  EXPECT_GT(HeadOf("stopped").pose_count, 2);
  EXPECT_LT(HeadOf("stopped").pose_count, kScanCount);
  ASSERT_TRUE(Ingest("stopped", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("stopped").revision, expected.revision);
  EXPECT_EQ(HeadOf("stopped").digest, expected.digest);
  // Killed at any commit, those of the end among them.
  for (const Revision cut : {Revision{1}, expected.revision / 2, expected.revision - 1}) {
    SCOPED_TRACE(cut);
    const std::string map = absl::StrCat("killed", cut);
    EXPECT_FALSE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0)), static_cast<int>(cut)).ok());
    ASSERT_TRUE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0))).ok());
    EXPECT_EQ(HeadOf(map).digest, expected.digest);
  }
  ASSERT_TRUE(Ingest("whole", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("whole").digest, expected.digest);
}

TEST_F(FollowedRoom, GivesWhatTheFinishedFileGives) {
  ASSERT_TRUE(Ingest("followed", Begin(1.0), FollowFor(milliseconds(0))).ok());
  ASSERT_TRUE(Ingest("finished", Begin(1.0), {}).ok());
  const auto followed = *(*store_->OpenMap("followed"))->Latest();
  const auto finished = *(*store_->OpenMap("finished"))->Latest();
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
  for (const LayerId layer : {layers::kBuildings, layers::kRooms, layers::kPlaces,
                              layers::kStructures, layers::kObjects, layers::kAgents}) {
    const std::vector<Node> a = NodesOf("followed", layer);
    const std::vector<Node> b = NodesOf("finished", layer);
    ASSERT_EQ(a.size(), b.size()) << layer;
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].id, b[i].id);
      EXPECT_EQ(a[i].map_T_node.position, b[i].map_T_node.position);
    }
  }
  const std::vector<BlockIndex> blocks = *followed->MeshBlocks();
  EXPECT_EQ(blocks, *finished->MeshBlocks());
  for (const BlockIndex& index : blocks) {
    EXPECT_EQ(followed->ReadMeshBlock(index)->positions_map,
              finished->ReadMeshBlock(index)->positions_map);
  }
}

TEST_F(FollowedRoom, IsRefusedIfItGrowsAfterItsEndWasTold) {
  ASSERT_TRUE(Ingest("office", Begin(0.6), FollowFor(milliseconds(0))).ok());
  const RevisionInfo head = HeadOf("office");
  const auto again = Ingest("office", Begin(0.6), FollowFor(milliseconds(0)));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(HeadOf("office").digest, head.digest);
  const absl::Status refused = Ingest("office", Begin(1.0), FollowFor(milliseconds(0))).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
  EXPECT_NE(refused.message().find("it has grown since"), std::string::npos) << refused;
  EXPECT_EQ(HeadOf("office").digest, head.digest);
}

}  // namespace
}  // namespace dsg::ingest
