// SPDX-License-Identifier: Apache-2.0
// Logs that are committed while they grow, for the tests of the pipeline.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/depth/made_scan.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {

inline LogOptions FollowFor(std::chrono::milliseconds timeout,
                            const std::atomic<bool>* stop = nullptr) {
  LogOptions options;
  options.follow = FollowOptions{.timeout = timeout, .stop = stop};
  return options;
}

/// A store in memory, and logs into its maps.
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
    return IngestOpen(map, *log, options, commit_count_max);
  }

  // The map must be there.
  absl::StatusOr<IngestSummary> IngestOpen(const std::string& map, LogSource& log,
                                           const LogOptions& options, int commit_count_max = -1) {
    DSG_ASSIGN_OR_RETURN(const auto own_writer, store_->OpenWriter(map));
    FragileWriter writer(*own_writer, commit_count_max);
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store_->OpenMap(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader->Latest());
    IngestOptions ingest_options;
    ingest_options.poses_per_delta = 7;
    ingest_options.mapping.volume.range_m = 8.0;
    ingest_options.open_again = open_again_;
    return IngestLog(log, options, ingest_options, *MakeSnapshotMapView(latest, reader), writer,
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
  /// IngestOptions::open_again.
  std::function<absl::StatusOr<std::unique_ptr<LogSource>>()> open_again_;
};

/// A robot with a lidar turns in a room, for eight seconds.
class FollowedRoom : public FollowTest {
 protected:
  static constexpr int kScanCount = 20;

  void SetUp() override {
    FollowTest::SetUp();
    Recording recording;
    for (int i = 0; i < kScanCount; ++i) {
      const TimeNs t = StampOfScan(i);
      const Pose3d map_T_lidar = PoseOfScan(i);
      std::vector<std::array<float, 3>> points;
      for (const Eigen::Vector3f& point : MadeScan(map_T_lidar)) {
        points.push_back({point.x(), point.y(), point.z()});
      }
      recording.push_back({"/points", "sensor_msgs/PointCloud2", t,
                           CloudFields(CdrWriter(), t, "base_link", points)});
      AddPoses(i, &recording);
    }
    AddLoops(&recording);
    std::stable_sort(
        recording.begin(), recording.end(),
        [](const RecordedMessage& a, const RecordedMessage& b) { return a.time_ns < b.time_ns; });
    bytes_ = WriteMcap(recording);
  }

  static TimeNs StampOfScan(int i) { return kT0 + TimeNs{i} * 400'000'000; }
  static Pose3d PoseOfScan(int i) {
    const double half_turn = 0.1 * i;
    Pose3d map_T_lidar;
    map_T_lidar.position = {0.1 * i, 1.0, 1.1};
    map_T_lidar.orientation = Eigen::Quaterniond(std::cos(half_turn), 0, 0, std::sin(half_turn));
    return map_T_lidar;
  }
  static std::vector<double> Numbers(const Pose3d& pose) {
    const Eigen::Vector3d& t = pose.position;
    const Eigen::Quaterniond& q = pose.orientation;
    return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
  }

  /// The poses of a scan: a topic's, unless a test says otherwise.
  virtual void AddPoses(int i, Recording* recording) {
    recording->push_back({"/odom", "nav_msgs/Odometry", StampOfScan(i),
                          OdometryFields(CdrWriter(), StampOfScan(i), Numbers(PoseOfScan(i)))});
  }
  virtual void AddLoops(Recording* /*recording*/) {}

  std::string Begin(double share) {
    const auto size = static_cast<size_t>(share * static_cast<double>(bytes_.size()));
    return folder_.Write("scans.mcap", bytes_.substr(0, size));
  }

  std::string bytes_;
};

}  // namespace dsg::ingest
