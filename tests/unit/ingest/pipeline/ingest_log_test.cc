// SPDX-License-Identifier: Apache-2.0
// Whole logs into real stores: repetition, interruption, overlap, contradiction.
#include "ingest/pipeline/ingest_log.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/log/given_log.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

constexpr int kAllCommits = -1;

// The value itself, so that it outlives the StatusOr in a range-for.
template <typename T>
T Value(absl::StatusOr<T> value) {
  EXPECT_TRUE(value.ok()) << value.status();
  return *std::move(value);
}

// A store with one map, "test".
class TestMap {
 public:
  explicit TestMap(TrajectoryCodec codec = TrajectoryCodec::kQuantized, TimeNs epoch_ns = 0) {
    StoreOptions options;
    options.create = true;
    store_ = *GraphStore::Open(folder_.Path("store"), options);
    MapSpec spec;
    spec.name = "test";
    spec.codec = codec;
    spec.epoch_ns = epoch_ns;
    EXPECT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("test");
    reader_ = *store_->OpenMap("test");
  }

  absl::StatusOr<IngestSummary> Ingest(const std::string& path, int64_t poses_per_delta = 100,
                                       int commit_count_max = kAllCommits,
                                       const LogOptions& log_options = {}) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<LogSource> log, OpenLog(path, log_options));
    return Take(*log, log_options, {.poses_per_delta = poses_per_delta}, commit_count_max);
  }

  absl::StatusOr<IngestSummary> Take(LogSource& log, const LogOptions& log_options,
                                     const IngestOptions& options,
                                     int commit_count_max = kAllCommits) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader_->Latest());
    const std::unique_ptr<MapView> view = MakeSnapshotMapView(latest, reader_);
    FragileWriter writer(*writer_, commit_count_max);
    absl::StatusOr<IngestSummary> summary = IngestLog(log, log_options, options, *view, writer, {});
    deltas_.insert(deltas_.end(), writer.deltas().begin(), writer.deltas().end());
    return summary;
  }

  void Commit(GraphDelta delta) {
    delta.map = "test";
    delta.session_id = absl::StrCat("by hand ", ++hand_count_);
    delta.sequence = 1;
    const absl::StatusOr<CommitResult> result = writer_->Commit(std::move(delta));
    ASSERT_TRUE(result.ok()) << result.status();
  }

  Revision head() { return reader_->Head()->revision; }
  std::shared_ptr<const Snapshot> Latest() { return *reader_->Latest(); }
  /// All deltas committed by Ingest, as JSON.
  const std::vector<std::string>& deltas() const { return deltas_; }

  /// Agents with their poses and stays, as text.
  std::string Content() {
    const std::shared_ptr<const Snapshot> map = Latest();
    std::ostringstream out;
    out.precision(17);
    for (const TrackInfo& track : Value(map->Tracks())) {
      const Node node = *map->GetNode(track.agent);
      out << ToString(track.agent) << " " << track.name << " " << track.kind << " "
          << track.pose_count << " valid " << node.valid.from_ns << " " << node.valid.to_ns
          << " observed " << *node.first_observed_ns << " " << *node.last_observed_ns << " "
          << node.observation_count << " at " << node.map_T_node.position.transpose() << "\n";
      EXPECT_TRUE(map->ReadPoses(track.agent, kTimeMin, kTimeMax, {},
                                 [&](const TimedPose& pose) {
                                   out << "  " << pose.time_ns << " "
                                       << pose.map_T_agent.position.transpose() << "\n";
                                   return true;
                                 })
                      .ok());
      for (const Stay& stay : Value(map->StaysOfAgent(track.agent, kTimeMin, kTimeMax))) {
        out << "  stay " << ToString(stay.place) << " " << ToString(stay.room) << " "
            << stay.enter_ns << " " << stay.exit_ns << "\n";
      }
    }
    return out.str();
  }

 private:
  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  std::vector<std::string> deltas_;
  int hand_count_ = 0;
};

GraphDelta TwoRoomWorld() {
  GraphDelta world;
  for (Node node : {MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5)}) world.nodes.push_back(node);
  for (Node node : {MakePlace(1, 1, 2), MakePlace(2, 4, 2), MakePlace(3, 7, 2)}) {
    world.nodes.push_back(node);
  }
  for (const auto& [room, place] : {std::pair(1, 1), std::pair(1, 2), std::pair(2, 3)}) {
    Edge edge;
    edge.source = NodeId('R', static_cast<uint64_t>(room));
    edge.relation = relations::kContains;
    edge.target = NodeId('p', static_cast<uint64_t>(place));
    world.edges.push_back(edge);
  }
  return world;
}

// Rows of a TrajNet log: four people walk to and fro through two rooms; number 3 is away between
// steps 60 and 90, and number 4 comes at step 70.
std::string WalkRows(int from_step, int to_step) {
  std::string rows;
  for (int step = from_step; step < to_step; ++step) {
    for (int person = 1; person <= 4; ++person) {
      if (person == 3 && step >= 60 && step < 90) continue;
      if (person == 4 && step < 70) continue;
      const double x = 5.0 + 4.5 * std::sin(0.07 * step * person);
      absl::StrAppend(&rows, step, " ", person, " ", x, " ", 1.0 + 0.5 * person, "\n");
    }
  }
  return rows;
}

constexpr int kWalkStepCount = 120;

class IngestLogTest : public testing::Test {
 protected:
  std::string WalkLog() { return folder_.Write("walk.txt", WalkRows(0, kWalkStepCount)); }

  TempFolder folder_;
};

TEST_F(IngestLogTest, BringsAgentsPosesAndStays) {
  TestMap map;
  map.Commit(TwoRoomWorld());
  const auto summary = map.Ingest(WalkLog());
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->agent_count, 4);
  EXPECT_EQ(summary->committed.pose_count, 4 * kWalkStepCount - 30 - 70);
  const auto snapshot = map.Latest();
  EXPECT_EQ(*snapshot->ResolveAgent("3"), NodeId('H', 3));
  const Node anna = *snapshot->GetNode(NodeId('H', 1));
  EXPECT_EQ(anna.observation_count, kWalkStepCount);
  EXPECT_EQ(*anna.last_observed_ns, (kWalkStepCount - 1) * TimeNs{400'000'000});
  const std::vector<Stay> stays = *snapshot->StaysOfAgent(NodeId('H', 3), kTimeMin, kTimeMax);
  ASSERT_FALSE(stays.empty());
  bool ends_at_gap = false;
  for (const Stay& stay : stays) {
    EXPECT_NE(stay.exit_ns, kTimeMax) << "the log is over";
    ends_at_gap |= stay.exit_ns == 59 * TimeNs{400'000'000} + 1;
  }
  EXPECT_TRUE(ends_at_gap);
}

TEST_F(IngestLogTest, AddsNothingTheSecondTime) {
  TestMap map;
  map.Commit(TwoRoomWorld());
  ASSERT_TRUE(map.Ingest(WalkLog()).ok());
  const Revision head = map.head();
  const auto again = map.Ingest(WalkLog());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->committed.revision_count, 0);
  EXPECT_EQ(again->committed.skipped_pose_count, 4 * kWalkStepCount - 30 - 70);
  EXPECT_EQ(map.head(), head);
}

TEST_F(IngestLogTest, AddsNothingWhenTheSamePosesComeInAnotherLog) {
  TestMap map;
  map.Commit(TwoRoomWorld());
  ASSERT_TRUE(map.Ingest(WalkLog()).ok());
  const Revision head = map.head();
  const std::string copy = folder_.Write("copy.txt", WalkRows(0, kWalkStepCount) + "\n");
  for (const int64_t poses_per_delta : {100, 37, 5000}) {
    const auto again = map.Ingest(copy, poses_per_delta);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->committed.revision_count, 0);
  }
  EXPECT_EQ(map.head(), head);
}

TEST_F(IngestLogTest, GivesTheSameDeltasForTheSameLogAndMap) {
  TestMap a;
  TestMap b;
  a.Commit(TwoRoomWorld());
  b.Commit(TwoRoomWorld());
  ASSERT_TRUE(a.Ingest(WalkLog()).ok());
  ASSERT_TRUE(b.Ingest(WalkLog()).ok());
  EXPECT_GE(a.deltas().size(), 5u);
  EXPECT_EQ(a.deltas(), b.deltas());
}

TEST_F(IngestLogTest, ContinuesAfterAnyInterruptionToTheSameDeltas) {
  TestMap undisturbed;
  undisturbed.Commit(TwoRoomWorld());
  ASSERT_TRUE(undisturbed.Ingest(WalkLog()).ok());
  const int commit_count = static_cast<int>(undisturbed.deltas().size());
  for (int cut = 0; cut < commit_count; ++cut) {
    TestMap map;
    map.Commit(TwoRoomWorld());
    EXPECT_FALSE(map.Ingest(WalkLog(), 100, cut).ok());
    EXPECT_FALSE(map.Ingest(WalkLog(), 100, cut == 0 ? 0 : 1).ok() && cut + 1 < commit_count);
    const auto resumed = map.Ingest(WalkLog());
    ASSERT_TRUE(resumed.ok()) << cut << resumed.status();
    EXPECT_EQ(map.deltas(), undisturbed.deltas()) << cut;
    EXPECT_EQ(map.Content(), undisturbed.Content()) << cut;
  }
}

TEST_F(IngestLogTest, GivesTheSameMapWhateverThePosesOfADelta) {
  TestMap expected;
  expected.Commit(TwoRoomWorld());
  ASSERT_TRUE(expected.Ingest(WalkLog(), 5000).ok());
  for (const int64_t poses_per_delta : {1, 3, 50, 333}) {
    TestMap map;
    map.Commit(TwoRoomWorld());
    ASSERT_TRUE(map.Ingest(WalkLog(), poses_per_delta).ok());
    EXPECT_EQ(map.Content(), expected.Content()) << poses_per_delta;
  }
}

TEST_F(IngestLogTest, TakesTheRestOfALogThatWasCutShort) {
  TestMap expected;
  expected.Commit(TwoRoomWorld());
  ASSERT_TRUE(expected.Ingest(WalkLog()).ok());
  for (const int cut_step : {1, 65, 80, 110}) {
    TestMap map;
    map.Commit(TwoRoomWorld());
    ASSERT_TRUE(map.Ingest(folder_.Write("head.txt", WalkRows(0, cut_step))).ok());
    const int64_t known_count = map.Latest()->Stats()->at.pose_count;
    const auto summary = map.Ingest(WalkLog());
    ASSERT_TRUE(summary.ok()) << cut_step << summary.status();
    EXPECT_EQ(summary->committed.skipped_pose_count, known_count);
    EXPECT_EQ(map.Content(), expected.Content()) << cut_step;
    const Revision head = map.head();
    ASSERT_TRUE(map.Ingest(WalkLog()).ok());
    EXPECT_EQ(map.head(), head);
  }
}

TEST_F(IngestLogTest, TakesTheRestAlsoWhenInterrupted) {
  TestMap expected;
  expected.Commit(TwoRoomWorld());
  ASSERT_TRUE(expected.Ingest(WalkLog()).ok());
  const std::string head = folder_.Write("head.txt", WalkRows(0, 80));
  for (int cut = 0; cut < 6; ++cut) {
    TestMap map;
    map.Commit(TwoRoomWorld());
    EXPECT_FALSE(map.Ingest(head, 50, cut % 4).ok());
    const bool is_done = map.Ingest(WalkLog(), 100, cut).ok();
    const auto resumed = map.Ingest(WalkLog());
    ASSERT_TRUE(is_done || resumed.ok()) << cut << resumed.status();
    EXPECT_EQ(map.Content(), expected.Content()) << cut;
  }
}

TEST_F(IngestLogTest, RefusesALogThatContradictsStoredPoses) {
  TestMap map;
  ASSERT_TRUE(map.Ingest(folder_.Write("a.txt", "0 1 1.0 2.0\n1 1 1.5 2.0\n2 1 2 2\n")).ok());
  const Revision head = map.head();
  const absl::Status moved =
      map.Ingest(folder_.Write("b.txt", "0 1 1.0 2.0\n1 1 1.5 2.25\n2 1 2 2\n3 1 3 3\n")).status();
  EXPECT_EQ(ReasonOf(moved), Reason::kTrackConflict);
  EXPECT_EQ(moved.code(), absl::StatusCode::kAlreadyExists);
  for (const char* part : {"H1", "400000000 ns", "(1.5000, 2.2500, 0.0000)",
                           "(1.5000, 2.0000, 0.0000)", "--agent-prefix", "--map"}) {
    EXPECT_NE(std::string(moved.message()).find(part), std::string::npos) << moved;
  }
  const absl::Status between =
      map.Ingest(folder_.Write("c.txt", "0 1 1.0 2.0\n1 2 0 0\n2 2 0 0\n3 2 0 0\n4 1 9 9\n"))
          .status();
  EXPECT_TRUE(between.ok()) << "a log with fewer of the poses says nothing else: " << between;
  EXPECT_EQ(ReasonOf(map.Ingest(folder_.Write("d.txt", "0 1 1.0 2.0\n3 1 1 1\n6 1 1 1\n"), 100,
                                kAllCommits,
                                {.format = "auto",
                                 .epoch_ns = 0,
                                 .frame_period_ns = 500'000'000,
                                 .agent_prefix = "",
                                 .mesh_block_size_m = 2.0})
                         .status()),
            Reason::kTrackConflict)
      << "no pose is stored at 0.5 s";
  EXPECT_EQ(map.head(), head + 1);
}

TEST_F(IngestLogTest, KeepsLogsApartByPrefix) {
  TestMap map;
  ASSERT_TRUE(map.Ingest(folder_.Write("a.txt", "0 1 1.0 2.0\n1 1 1.5 2.0\n")).ok());
  LogOptions options;
  options.agent_prefix = "b/";
  const auto summary =
      map.Ingest(folder_.Write("b.txt", "0 1 9.0 2.0\n1 1 9.5 2.0\n"), 100, kAllCommits, options);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(*map.Latest()->ResolveAgent("1"), NodeId('H', 1));
  EXPECT_EQ(*map.Latest()->ResolveAgent("b/1"), NodeId('H', 2));
}

TEST_F(IngestLogTest, ComparesBitByBitInALosslessMap) {
  const std::string a = folder_.Write("a.txt", "0 1 1.0 2.0\n1 1 1.5 2.0\n");
  const std::string b = folder_.Write("b.txt", "0 1 1.0 2.0\n1 1 1.50001 2.0\n");
  TestMap lossless(TrajectoryCodec::kLossless);
  ASSERT_TRUE(lossless.Ingest(a).ok());
  EXPECT_EQ(ReasonOf(lossless.Ingest(b).status()), Reason::kTrackConflict);
  TestMap quantized;
  ASSERT_TRUE(quantized.Ingest(a).ok());
  EXPECT_TRUE(quantized.Ingest(b).ok()) << "0.01 mm is within the codec's bound";
}

TEST_F(IngestLogTest, TakesRoomsFromTheLogItself) {
  GraphDelta world = TwoRoomWorld();
  folder_.Write("sim/map.json", DeltaToJson(world));
  std::string rows = "time_ns,agent,kind,x,y,z,qx,qy,qz,qw\n";
  for (int i = 0; i < 50; ++i) {
    absl::StrAppend(&rows, i * 100'000'000LL, ",anna,human,", 0.2 * i, ",2,0,,,,\n");
  }
  folder_.Write("sim/tracks.csv", rows);
  TestMap map;
  const auto summary = map.Ingest(folder_.Path("sim"), 7);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->committed.node_count, 5 + 1);
  EXPECT_EQ(summary->committed.stay_count, 3);
  EXPECT_EQ(summary->committed.edge_count, 3);
  const std::vector<Stay> stays = *map.Latest()->StaysOfAgent(NodeId('H', 0), kTimeMin, kTimeMax);
  ASSERT_EQ(stays.size(), 3u);
  EXPECT_EQ(stays[0].place, NodeId('p', 1));
  EXPECT_EQ(stays[1].place, NodeId('p', 2));
  EXPECT_EQ(stays[2].room, NodeId('R', 2));
  EXPECT_EQ(stays[2].exit_ns, 49 * TimeNs{100'000'000} + 1);
  for (int cut = 0; cut < 8; ++cut) {
    TestMap other;
    EXPECT_FALSE(other.Ingest(folder_.Path("sim"), 7, cut).ok());
    ASSERT_TRUE(other.Ingest(folder_.Path("sim"), 7).ok());
    EXPECT_EQ(other.deltas(), map.deltas());
  }
}

TEST_F(IngestLogTest, EndsStaysThatAnAbandonedRunLeftOpen) {
  TestMap map;
  map.Commit(TwoRoomWorld());
  EXPECT_FALSE(map.Ingest(WalkLog(), 50, 1).ok());
  // Another log, much later, goes on with the same person elsewhere.
  LogOptions later;
  later.epoch_ns = 1000 * kNsPerSecond;
  ASSERT_TRUE(
      map.Ingest(folder_.Write("later.txt", "0 1 8 2\n1 1 8 2\n"), 100, kAllCommits, later).ok());
  TimeNs last_exit_ns = kTimeMin;
  const auto snapshot = map.Latest();
  for (const Stay& stay : Value(snapshot->StaysOfAgent(NodeId('H', 1), kTimeMin, kTimeMax))) {
    EXPECT_GE(stay.enter_ns, last_exit_ns);
    EXPECT_NE(stay.exit_ns, kTimeMax);
    last_exit_ns = stay.exit_ns;
  }
  EXPECT_EQ(last_exit_ns, 1000 * kNsPerSecond + 400'000'001);
}

TEST_F(IngestLogTest, RefusesDeltasOfNoSize) {
  TestMap map;
  EXPECT_EQ(ReasonOf(map.Ingest(WalkLog(), 0).status()), Reason::kFieldInvalid);
}

TEST_F(IngestLogTest, CountsSensorsThatItDoesNotUseYetAndTakesThePosesAskedFor) {
  const std::string header = "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n";
  folder_.Write("rig/mav0/imu0/data.csv", "#\n5,0,0,0,0,0,9.81\n10,0,0,0,0,0,9.81\n");
  folder_.Write("rig/mav0/state_groundtruth_estimate0/data.csv", header + "5,1,0,0,1,0,0,0\n");
  folder_.Write("rig/mav0/state_external0/data.csv",
                header + "5,2,0,0,1,0,0,0\n10,3,0,0,1,0,0,0\n");
  TestMap map;
  LogOptions options;
  options.poses = PoseSource::kGroundTruth;
  const auto truth = map.Ingest(folder_.Path("rig"), 100, kAllCommits, options);
  ASSERT_TRUE(truth.ok()) << truth.status();
  EXPECT_EQ(truth->committed.pose_count, 1);
  EXPECT_EQ(truth->unused, (std::map<std::string, int64_t>{{"imu0", 2}}));
  options.poses = PoseSource::kExternal;
  EXPECT_EQ(ReasonOf(map.Ingest(folder_.Path("rig"), 100, kAllCommits, options).status()),
            Reason::kTrackConflict)
      << "other poses are another session, not a repetition";
}

TEST_F(IngestLogTest, TakesLaterSnapshotsOfARealSceneGraph) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const std::string stem =
      (DataFolder() / "dsg-spark" / "mp3d_x8F5xyUWy9e_0_partial_dsg_").string();
  TestMap map;
  const auto first = map.Ingest(stem + "600.json");
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->committed.pose_count, 600);
  const auto second = map.Ingest(stem + "1447.json");
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->committed.pose_count + second->committed.skipped_pose_count, 1445);
  EXPECT_LT(second->committed.node_count, 1939) << "what did not change is not written again";
}

TEST_F(IngestLogTest, TakesRealPeopleAndRobots) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  struct Expected {
    const char* path;
    int64_t agent_count;
    int64_t pose_count;
    TimeNs epoch_ns;
  };
  for (const Expected& expected : {Expected{"people-eth-ucy/eth/obsmat.txt", 360, 8908, 0},
                                   Expected{"people-lcas/lcas.ndjson", 304, 9610, 0},
                                   Expected{"people-thor-magni/Scenario_5.csv", 502, 10040, 0},
                                   Expected{"euroc-mh01-stereo", 1, 1791, 1403636584263555584}}) {
    TestMap map(TrajectoryCodec::kQuantized, expected.epoch_ns);
    const auto summary = map.Ingest((DataFolder() / expected.path).string(), 5000);
    ASSERT_TRUE(summary.ok()) << expected.path << summary.status();
    EXPECT_EQ(summary->agent_count, expected.agent_count);
    const MapStats stats = *map.Latest()->Stats();
    EXPECT_EQ(stats.at.agent_count, expected.agent_count);
    EXPECT_EQ(stats.at.pose_count, expected.pose_count);
  }
}

// Poses of a robot at a time, as odometry gives them.
absl::StatusOr<IngestSummary> TakeOdometry(TestMap& map, const std::string& content, TimeNs time_ns,
                                           const std::string& transform,
                                           const std::string& place_memory = "") {
  LogInfo info;
  // Of a robot with a camera.
  info.rig.cameras = {CameraCalibration{.name = "cam0", .width = 10, .height = 10}};
  if (!place_memory.empty()) info.place_memory = {place_memory};
  info.format = "euroc";
  info.path = content;
  info.content_sha256 = content;
  PoseMeasurement pose;
  pose.agent_name = "rover";
  pose.agent_kind = kinds::kRobot;
  std::deque<Measurement> measurements;
  for (int i = 0; i < 3; ++i) {
    pose.pose.time_ns = time_ns + i * 100'000'000;
    measurements.emplace_back(pose);
  }
  GivenLog log(info, std::move(measurements));
  LogOptions options;
  options.poses = PoseSource::kOdometry;
  return map.Take(log, options, {.transform = transform});
}

// It begins where its log begins.
TEST(IngestLog, TakesOdometryIntoTheMapOfAnotherLogOnlyWithATransform) {
  TestMap map;
  ASSERT_TRUE(TakeOdometry(map, "monday", 0, "").ok());
  EXPECT_TRUE(TakeOdometry(map, "monday", 0, "")->was_known);
  const absl::Status refused = TakeOdometry(map, "tuesday", 60'000'000'000, "").status();
  EXPECT_EQ(ReasonOf(refused), Reason::kNoRegistration);
  EXPECT_NE(refused.message().find("--transform"), std::string::npos) << refused;
  EXPECT_NE(refused.message().find("\"rover\""), std::string::npos) << refused;
  const auto laid = TakeOdometry(map, "tuesday", 60'000'000'000, "1,2,0,0.5");
  ASSERT_TRUE(laid.ok()) << laid.status();
  EXPECT_EQ(laid->committed.pose_count, 3);
  // With another one it is another session.
  EXPECT_FALSE(TakeOdometry(map, "tuesday", 120'000'000'000, "1,2,0,0.6")->was_known);
}

// A log that was taken without it, or cut off before its end, and a later one of the same robot.
TEST(IngestLog, AddsWhatARobotKnowsPlacesBy) {
  TestMap map;
  const auto memory = [&map] { return map.Latest()->GetNode(NodeId('r', 0))->agent->place_memory; };
  ASSERT_TRUE(TakeOdometry(map, "monday", 0, "").ok());
  EXPECT_TRUE(memory().empty());
  ASSERT_TRUE(TakeOdometry(map, "monday seen", 0, "0,0,0,0", "hall").ok());
  ASSERT_EQ(memory().size(), 1u);
  ASSERT_TRUE(TakeOdometry(map, "tuesday", 60'000'000'000, "0,0,0,0", "kitchen").ok());
  ASSERT_EQ(memory().size(), 2u);
  EXPECT_EQ(map.Latest()->ReadAsset(memory()[0])->content, "hall");
  EXPECT_EQ(map.Latest()->ReadAsset(memory()[1])->content, "kitchen");
  ASSERT_TRUE(TakeOdometry(map, "tuesday", 60'000'000'000, "0,0,0,0", "kitchen").ok());
  EXPECT_EQ(memory().size(), 2u);
}

TEST(IngestLog, TakesOdometryIntoAMapOfRoomsOnlyWithATransform) {
  TestMap map;
  map.Commit(TwoRoomWorld());
  EXPECT_EQ(ReasonOf(TakeOdometry(map, "monday", 0, "").status()), Reason::kNoRegistration);
  EXPECT_TRUE(TakeOdometry(map, "monday", 0, "0,0,0,0").ok());
}

}  // namespace
}  // namespace dsg::ingest
