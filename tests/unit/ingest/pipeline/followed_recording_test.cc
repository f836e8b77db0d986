// SPDX-License-Identifier: Apache-2.0
// Recordings that are followed, with poses of /tf and with loop closures: the map of the finished
// file.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/loop_file.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/pipeline/follow_fixture.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

// What one log measures, as the session of another one: digests name the session.
class InSessionOf : public LogSource {
 public:
  InSessionOf(std::unique_ptr<LogSource> log, LogInfo info)
      : log_(std::move(log)), info_(std::move(info)) {}
  const LogInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Measurement>> Next() override { return log_->Next(); }

 private:
  std::unique_ptr<LogSource> log_;
  LogInfo info_;
};

// Adds to the room what the tests of both kinds of recording ask.
class FollowedRecording : public FollowedRoom {
 protected:
  // The finished file's map, and the one that what is followed would make in its session, have the
  // same digest.
  void ExpectSameDigests() {
    const std::string path = Begin(1.0);
    const auto finished = Ingest("finished", path, {});
    ASSERT_TRUE(finished.ok()) << finished.status();
    MapSpec spec;
    spec.name = "same";
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    auto followed = OpenLog(path, FollowFor(milliseconds(0)));
    ASSERT_TRUE(followed.ok()) << followed.status();
    InSessionOf log(*std::move(followed), (*OpenLog(path, {}))->info());
    const auto same = IngestOpen("same", log, {});
    ASSERT_TRUE(same.ok()) << same.status();
    EXPECT_GT(HeadOf("finished").revision, 6);
    EXPECT_EQ(HeadOf("finished").pose_count, kScanCount);
    EXPECT_GT(HeadOf("finished").mesh_block_count, 0);
    EXPECT_EQ(HeadOf("same").revision, HeadOf("finished").revision);
    EXPECT_EQ(HeadOf("same").digest, HeadOf("finished").digest);
  }

  // Stopped, and killed in its middle, it ends in the same map.
  void ExpectTheSameHoweverOftenStopped() {
    const auto whole = Ingest("whole", Begin(1.0), FollowFor(milliseconds(0)));
    ASSERT_TRUE(whole.ok()) << whole.status();
    ASSERT_TRUE(whole->mapping.has_value());
    EXPECT_GT(whole->mapping->volume.frame_count, 0);
    const RevisionInfo expected = HeadOf("whole");
    EXPECT_EQ(expected.pose_count, kScanCount);
    std::atomic<bool> stop = false;
    const std::string path = Begin(0.7);
    std::thread stopper([&] {
      std::this_thread::sleep_for(milliseconds(1500));
      stop = true;
    });
    const auto paused = Ingest("stopped", path, FollowFor(milliseconds(60'000), &stop));
    stopper.join();
    ASSERT_TRUE(paused.ok()) << paused.status();
    EXPECT_TRUE(paused->is_paused);
    EXPECT_LT(HeadOf("stopped").pose_count, kScanCount);
    ASSERT_TRUE(Ingest("stopped", Begin(1.0), FollowFor(milliseconds(0))).ok());
    EXPECT_EQ(HeadOf("stopped").digest, expected.digest);
    EXPECT_FALSE(Ingest("killed", Begin(1.0), FollowFor(milliseconds(0)),
                        static_cast<int>(expected.revision / 2))
                     .ok());
    ASSERT_TRUE(Ingest("killed", Begin(1.0), FollowFor(milliseconds(0))).ok());
    EXPECT_EQ(HeadOf("killed").digest, expected.digest);
  }
};

// The odometry comes 40 ms after the scans; where the map is in it a fifth of a second later.
class RoomByTransforms : public FollowedRecording {
 protected:
  void AddPoses(int i, Recording* recording) override {
    const TimeNs t = StampOfScan(i);
    const Pose3d map_T_odom{{0.02 * i, 0, 0}, Eigen::Quaterniond::Identity()};
    const Pose3d odom_T_base = map_T_odom.Inverse() * PoseOfScan(i);
    recording->push_back({"/tf", "tf2_msgs/TFMessage", t + 40 * kMillisecond,
                          TfMessage({{"odom", "base_link", t, Numbers(odom_T_base)}})});
    // Not at the stamps of the scans.
    const TimeNs of_map = t - 130 * kMillisecond;
    const Pose3d then{{0.02 * i - 0.0065, 0, 0}, Eigen::Quaterniond::Identity()};
    recording->push_back({"/tf", "tf2_msgs/TFMessage", std::max(kT0, of_map + 200 * kMillisecond),
                          TfMessage({{"map", "odom", of_map, Numbers(then)}})});
  }
};

TEST_F(RoomByTransforms, GivesTheMapOfTheFinishedFile) {
  ExpectSameDigests();
  // And as its own session, the same things in the same places.
  ASSERT_TRUE(Ingest("followed", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
  for (const LayerId layer :
       {layers::kRooms, layers::kPlaces, layers::kStructures, layers::kObjects, layers::kAgents}) {
    const std::vector<Node> a = NodesOf("followed", layer);
    const std::vector<Node> b = NodesOf("finished", layer);
    ASSERT_EQ(a.size(), b.size()) << layer;
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].id, b[i].id);
      EXPECT_EQ(a[i].map_T_node.position, b[i].map_T_node.position);
    }
  }
}

TEST_F(RoomByTransforms, EndsInTheSameMapHoweverOftenItWasStopped) {
  ExpectTheSameHoweverOftenStopped();
}

// Odometry that drifts by 4 mm a scan; from the fifteenth scan on the robot knows where it began.
class RoomWithLoops : public FollowedRecording {
 protected:
  static constexpr double kDriftPerScanM = 0.004;

  void AddPoses(int i, Recording* recording) override {
    Pose3d odom_T_base = PoseOfScan(i);
    odom_T_base.position += i * drift_per_scan_m_;
    recording->push_back({"/odom", "nav_msgs/Odometry", StampOfScan(i),
                          OdometryFields(CdrWriter(), StampOfScan(i), Numbers(odom_T_base))});
  }
  static std::string LineOf(int from, int to) {
    LoopMeasurement loop;
    loop.from_ns = StampOfScan(from);
    loop.time_ns = StampOfScan(to);
    loop.from_T_to = PoseOfScan(from).Inverse() * PoseOfScan(to);
    loop.information = 1e4 * Eigen::Matrix<double, 6, 6>::Identity();
    return FormatLoop(loop);
  }
  void AddLoops(Recording* recording) override {
    for (const int to : {14, 17}) {
      recording->push_back({"/dsg/loop_closures", "std_msgs/String",
                            StampOfScan(to) + recorded_after_ns_,
                            StringFields(CdrWriter(), LineOf(0, to))});
    }
  }
  // Positions of the robot in the order of time.
  std::vector<Eigen::Vector3d> PathOf(const std::string& map) {
    std::vector<Eigen::Vector3d> path;
    const auto latest = *(*store_->OpenMap(map))->Latest();
    const std::vector<TrackInfo> tracks = *latest->Tracks();
    EXPECT_EQ(tracks.size(), 1u);
    EXPECT_TRUE(latest
                    ->ReadPoses(tracks[0].agent, kTimeMin, kTimeMax, {},
                                [&](const TimedPose& pose) {
                                  path.push_back(pose.map_T_agent.position);
                                  return true;
                                })
                    .ok());
    return path;
  }

  // Mean distance of the mesh from the room that was scanned, metres.
  double OffSurfaceOf(const std::string& map) {
    const auto latest = *(*store_->OpenMap(map))->Latest();
    double sum_m = 0.0;
    int count = 0;
    const std::vector<BlockIndex> indices = *latest->MeshBlocks();
    for (const BlockIndex& index : indices) {
      const MeshBlock block = *latest->ReadMeshBlock(index);
      for (const Eigen::Vector3f& point : block.positions_map) {
        sum_m += OffSurface(point.cast<double>());
        ++count;
      }
    }
    EXPECT_GT(count, 1000);
    return sum_m / count;
  }

  TimeNs recorded_after_ns_ = 250 * kMillisecond;
  Eigen::Vector3d drift_per_scan_m_{0.0, kDriftPerScanM, 0.0};
};

TEST_F(RoomWithLoops, GivesTheMapOfTheFinishedFile) {
  ExpectSameDigests();
  const auto followed = Ingest("followed", Begin(1.0), FollowFor(milliseconds(0)));
  ASSERT_TRUE(followed.ok()) << followed.status();
  ASSERT_TRUE(followed->loops.has_value());
  EXPECT_EQ(followed->loops->kept_count, 2);
  EXPECT_GT(followed->loops->largest_m, 0.02);
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
  // The drift of the last scan that a loop closure knows is all but gone.
  EXPECT_LT(std::abs(PathOf("followed")[17].y() - 1.0), 0.5 * 17 * kDriftPerScanM);
}

TEST_F(RoomWithLoops, EndsInTheSameMapHoweverOftenItWasStopped) {
  ExpectTheSameHoweverOftenStopped();
}

TEST_F(RoomWithLoops, OfAFileGivesTheSameMap) {
  LogOptions with_file;
  with_file.loop_file =
      folder_.Write("loops.jsonl", absl::StrCat(LineOf(0, 17), "\n", LineOf(0, 14), "\n"));
  ASSERT_TRUE(Ingest("finished", Begin(1.0), with_file).ok());
  with_file.follow = FollowFor(milliseconds(0)).follow;
  const auto followed = Ingest("followed", Begin(1.0), with_file);
  ASSERT_TRUE(followed.ok()) << followed.status();
  EXPECT_EQ(followed->loops->kept_count, 2);
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
  EXPECT_LT(std::abs(PathOf("followed")[17].y() - 1.0), 0.5 * 17 * kDriftPerScanM);
}

// One of which less is left by then is not taken for all there is; it goes on once it is whole.
TEST_F(RoomWithLoops, TellsIfLessOfItIsReadAgain) {
  const std::string path = Begin(1.0);
  const std::string rest = folder_.Write("rest.mcap", bytes_.substr(0, bytes_.size() / 2));
  open_again_ = [&] { return OpenLog(rest, {}); };
  const auto summary = Ingest("home", path, {});
  EXPECT_EQ(ReasonOf(summary.status()), Reason::kFileMalformed) << summary.status();
  EXPECT_GT(HeadOf("home").mesh_block_count, 0);
  open_again_ = [&] { return OpenLog(path, {}); };
  ASSERT_TRUE(Ingest("home", path, {}).ok());
  ASSERT_TRUE(Ingest("whole", path, {}).ok());
  EXPECT_EQ(HeadOf("home").digest, HeadOf("whole").digest);
}

// A log that is gone by then ends the run; what was committed stays.
TEST_F(RoomWithLoops, TellsIfItCannotBeReadAgain) {
  const std::string path = Begin(1.0);
  open_again_ = [] { return OpenLog("gone.mcap", {}); };
  const auto summary = Ingest("home", path, {});
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kNotFound) << summary.status();
  EXPECT_GT(HeadOf("home").pose_count, 0);
}

// Outside of all that was recorded, they change nothing but their count.
TEST_F(RoomWithLoops, OutsideOfTheLogAreCounted) {
  LoopMeasurement stray;
  stray.from_ns = 5;
  stray.time_ns = INT64_MAX - 1;
  LogOptions with_file;
  with_file.loop_file = folder_.Write(
      "loops.jsonl", absl::StrCat(LineOf(0, 17), "\n", LineOf(0, 14), "\n", FormatLoop(stray)));
  for (const bool is_followed : {false, true}) {
    if (is_followed) with_file.follow = FollowFor(milliseconds(0)).follow;
    const std::string map = is_followed ? "followed" : "finished";
    const auto summary = Ingest(map, Begin(1.0), with_file);
    ASSERT_TRUE(summary.ok()) << summary.status();
    EXPECT_EQ(summary->loops->loop_count, 3);
    EXPECT_EQ(summary->loops->unusable_count, 1);
    EXPECT_EQ(summary->loops->kept_count, 2);
  }
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
}

// Odometry of steps that are too long, as wheels have it.
class RoomOfLongSteps : public RoomWithLoops {
 protected:
  RoomOfLongSteps() { drift_per_scan_m_ = {kDriftPerScanM, 0.0, 0.0}; }
};

// Along the corrected path, the surface is nearer to the room than what was moved.
TEST_F(RoomOfLongSteps, IsFusedAgainWhenItHasEnded) {
  const std::string path = Begin(1.0);
  const auto once = Ingest("once", path, {});
  ASSERT_TRUE(once.ok()) << once.status();
  int opened_count = 0;
  open_again_ = [&] {
    ++opened_count;
    return OpenLog(path, {});
  };
  const auto again = Ingest("again", path, {});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(opened_count, 1);
  EXPECT_EQ(again->mapping->volume.frame_count, once->mapping->volume.frame_count);
  EXPECT_EQ(TracksOf("again"), TracksOf("once"));
  EXPECT_LT(OffSurfaceOf("again"), 0.9 * OffSurfaceOf("once"));
  const RevisionInfo head = HeadOf("again");
  EXPECT_FALSE(Ingest("killed", path, {}, static_cast<int>(head.revision) - 2).ok());
  ASSERT_TRUE(Ingest("killed", path, {}).ok());
  EXPECT_EQ(HeadOf("killed").digest, head.digest);
}

// Found more than a second after their stamps: the path is corrected later, and is the same in the
// end.
class RoomWithLateLoops : public RoomWithLoops {
 protected:
  RoomWithLateLoops() { recorded_after_ns_ = 1100 * kMillisecond; }
};

TEST_F(RoomWithLateLoops, EndsOnTheSamePath) {
  ASSERT_TRUE(Ingest("finished", Begin(1.0), {}).ok());
  const auto followed = Ingest("followed", Begin(1.0), FollowFor(milliseconds(0)));
  ASSERT_TRUE(followed.ok()) << followed.status();
  EXPECT_EQ(followed->loops->kept_count, 2);
  const std::vector<Eigen::Vector3d> a = PathOf("finished");
  const std::vector<Eigen::Vector3d> b = PathOf("followed");
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).norm(), 1e-3) << i;
}

// Twenty poses a second.
class RoomWithManyPoses : public FollowedRecording {
 protected:
  static constexpr int kPosesPerScan = 8;

  void AddPoses(int i, Recording* recording) override {
    for (int k = 0; k < kPosesPerScan; ++k) {
      const TimeNs t = StampOfScan(i) + k * 50 * kMillisecond;
      recording->push_back({"/odom", "nav_msgs/Odometry", t,
                            OdometryFields(CdrWriter(), t, Numbers(PoseOfScan(i)))});
    }
  }

  // How many a revision has brought at most.
  int64_t MostPosesAtOnce(const std::string& map) {
    constexpr int kRevisionsMax = 10'000;
    const std::vector<RevisionInfo> latest_first =
        *(*store_->OpenMap(map))->ListRevisions(HeadOf(map).revision + 1, kRevisionsMax);
    int64_t most = 0;
    for (size_t i = 0; i + 1 < latest_first.size(); ++i) {
      most = std::max(most, latest_first[i].pose_count - latest_first[i + 1].pose_count);
    }
    return most;
  }
};

TEST_F(RoomWithManyPoses, AreCommittedTenTimesASecond) {
  ASSERT_TRUE(Ingest("followed", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("followed").pose_count, kScanCount * kPosesPerScan);
  EXPECT_EQ(MostPosesAtOnce("followed"), 2);
  // Nobody waits for a log that is finished: a commit for each second of it.
  ASSERT_TRUE(Ingest("finished", Begin(1.0), {}).ok());
  EXPECT_GE(MostPosesAtOnce("finished"), 20);
}

TEST_F(RoomWithManyPoses, EndInTheSameMapHoweverOftenItWasStopped) {
  ASSERT_TRUE(Ingest("whole", Begin(1.0), FollowFor(milliseconds(0))).ok());
  const RevisionInfo whole = HeadOf("whole");
  for (const Revision cut : {3, 40, 77}) {
    const std::string map = absl::StrCat("cut", cut);
    EXPECT_FALSE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0)), static_cast<int>(cut)).ok());
    ASSERT_TRUE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0))).ok());
    EXPECT_EQ(HeadOf(map).digest, whole.digest);
    EXPECT_EQ(HeadOf(map).revision, whole.revision);
  }
}

TEST_F(FollowedRoom, WithoutLoopClosuresSaysNothingOfThem) {
  const auto summary = Ingest("office", Begin(1.0), FollowFor(milliseconds(0)));
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->loops.has_value());
}

}  // namespace
}  // namespace dsg::ingest
