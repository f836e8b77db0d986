// SPDX-License-Identifier: Apache-2.0
// Logs into a map that forgets while they run.
#include "ingest/commit/forgotten.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

constexpr TimeNs kStepNs = 400'000'000;
constexpr int kStepCount = 100;
constexpr int kNever = std::numeric_limits<int>::max();
constexpr NodeId kBert('H', 2);

// Forgets before one commit, and breaks down before another.
class ForgettingWriter : public GraphWriter {
 public:
  ForgettingWriter(GraphWriter& writer, int forget_at, std::function<void()> forget, int fail_at)
      : writer_(writer), forget_at_(forget_at), forget_(std::move(forget)), fail_at_(fail_at) {}

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override {
    if (!delta.empty() && count_++ == forget_at_) forget_();
    if (count_ > fail_at_) return absl::InternalError("the power went out");
    return writer_.Commit(std::move(delta));
  }
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override {
    return writer_.GetSession(session_id);
  }

 private:
  GraphWriter& writer_;
  int forget_at_;
  std::function<void()> forget_;
  int fail_at_;
  int count_ = 0;
};

// Anna walks through both rooms; Bert is not seen after step 50; three others walk about.
std::string Rows() {
  std::string rows;
  for (int step = 0; step < kStepCount; ++step) {
    for (int person = 1; person <= 5; ++person) {
      if (person == 2 && step > 50) continue;
      absl::StrAppend(&rows, step, " ", person, " ", 0.5 + 0.09 * step, " ", 0.8 * person, "\n");
    }
  }
  return rows;
}

GraphDelta House() {
  GraphDelta house;
  house.nodes = {MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5), MakePlace(1, 1, 2),
                 MakePlace(2, 4, 2), MakePlace(3, 7, 2)};
  for (const auto& [room, place] : {std::pair(1, 1), std::pair(1, 2), std::pair(2, 3)}) {
    Edge edge;
    edge.source = NodeId('R', static_cast<uint64_t>(room));
    edge.relation = relations::kContains;
    edge.target = NodeId('p', static_cast<uint64_t>(place));
    house.edges.push_back(edge);
  }
  return house;
}

class ForgottenTest : public testing::Test {
 protected:
  ForgottenTest() {
    StoreOptions options;
    options.create = true;
    store_ = *GraphStore::Open(folder_.Path("store"), options);
    MapSpec spec;
    spec.name = "test";
    EXPECT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("test");
    reader_ = *store_->OpenMap("test");
    log_ = folder_.Write("walk.txt", Rows());
  }

  void Commit(GraphDelta delta) {
    delta.session_id = absl::StrCat("by hand ", ++hand_count_);
    delta.sequence = 1;
    const auto result = writer_->Commit(std::move(delta));
    ASSERT_TRUE(result.ok()) << result.status();
  }

  void Retire(const std::vector<NodeId>& ids) {
    GraphDelta delta;
    delta.is_forgetting = true;
    for (const NodeId id : ids) delta.retirements.push_back({id, std::nullopt});
    Commit(std::move(delta));
  }

  absl::StatusOr<IngestSummary> Ingest(int forget_at, const std::vector<NodeId>& forget,
                                       int fail_at = kNever) {
    LogOptions options;
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<LogSource> log, OpenLog(log_, options));
    const auto view = MakeSnapshotMapView(*reader_->Latest(), reader_);
    ForgettingWriter writer(
        *writer_, forget_at, [&] { Retire(forget); }, fail_at);
    return IngestLog(*log, options, {.poses_per_delta = 50}, *view, writer, {});
  }

  std::shared_ptr<const Snapshot> Latest() { return *reader_->Latest(); }

  int64_t PoseCountOf(NodeId agent) {
    const auto track = Latest()->GetTrack(agent);
    return track.ok() ? track->pose_count : -1;
  }

  void ExpectSound() {
    const auto report = reader_->Verify({}, {});
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_TRUE(report->problems.empty()) << report->problems.front();
  }

  // Back under her name, with nothing of before.
  void ExpectAnnaIsBackSince(TimeNs since_ns) {
    const auto id = Latest()->ResolveAgent("1");
    ASSERT_TRUE(id.ok()) << id.status();
    const TrackInfo track = *Latest()->GetTrack(*id);
    EXPECT_EQ(track.first_ns, since_ns);
    EXPECT_EQ(track.last_ns, (kStepCount - 1) * kStepNs);
    const Node node = *Latest()->GetNode(*id);
    EXPECT_EQ(node.valid.from_ns, since_ns);
    EXPECT_EQ(node.first_observed_ns, since_ns);
    EXPECT_EQ(node.last_observed_ns, track.last_ns);
    EXPECT_EQ(node.observation_count, track.pose_count);
    const std::vector<Stay> stays = *Latest()->StaysOfAgent(*id, kTimeMin, kTimeMax);
    for (const Stay& stay : stays) {
      EXPECT_GE(stay.enter_ns, since_ns);
      EXPECT_NE(stay.exit_ns, kTimeMax);
    }
    EXPECT_TRUE(Latest()->StayAt(*id, since_ns)->has_value());
  }

  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  std::string log_;
  int hand_count_ = 0;
};

TEST_F(ForgottenTest, AgentComesBackWithWhatIsSeenFromThenOnAndTheLogEnds) {
  Commit(House());
  const auto summary = Ingest(/*forget_at=*/4, {kAnna, kBert});
  ASSERT_TRUE(summary.ok()) << summary.status();
  ExpectAnnaIsBackSince(40 * kStepNs);
  EXPECT_EQ(PoseCountOf(kBert), 11) << "of steps 40 to 50";
  for (const uint64_t other : {3, 4, 5}) EXPECT_EQ(PoseCountOf(NodeId('H', other)), kStepCount);
  ExpectSound();
}

TEST_F(ForgottenTest, AgentThatIsNotSeenAgainStaysAway) {
  Commit(House());
  const auto summary = Ingest(/*forget_at=*/7, {kBert});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(Latest()->GetNode(kBert).ok());
  EXPECT_EQ(PoseCountOf(kAnna), kStepCount);
  ExpectSound();
}

TEST_F(ForgottenTest, RoomWithItsPlacesStaysAwayAndTheLogEnds) {
  Commit(House());
  const auto summary = Ingest(/*forget_at=*/2, {NodeId('p', 3), NodeId('R', 2), NodeId('p', 2)});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(Latest()->GetNode(NodeId('R', 2)).ok());
  EXPECT_FALSE(Latest()->GetNode(NodeId('p', 3)).ok());
  for (const uint64_t other : {1, 3, 4, 5}) EXPECT_EQ(PoseCountOf(NodeId('H', other)), kStepCount);
  const auto stays = *Latest()->StaysOfAgent(kAnna, kTimeMin, kTimeMax);
  EXPECT_FALSE(stays.empty());
  for (const Stay& stay : stays) EXPECT_EQ(stay.room, NodeId('R', 1));
  ExpectSound();
}

TEST_F(ForgottenTest, RunThatWasCutOffGoesOnAfterAnythingWasForgotten) {
  Commit(House());
  EXPECT_FALSE(Ingest(kNever, {}, /*fail_at=*/4).ok());
  Retire({kAnna, NodeId('R', 1)});
  const auto resumed = Ingest(kNever, {});
  ASSERT_TRUE(resumed.ok()) << resumed.status();
  ExpectAnnaIsBackSince(40 * kStepNs);
  ExpectSound();
  const Revision head = Latest()->revision();
  const auto again = Ingest(kNever, {});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(Latest()->revision(), head);
}

TEST_F(ForgottenTest, RunThatWasCutOffAfterAReturnDoesNotBringBackTheRest) {
  Commit(House());
  EXPECT_FALSE(Ingest(/*forget_at=*/2, {kAnna}, /*fail_at=*/5).ok());
  const auto resumed = Ingest(kNever, {});
  ASSERT_TRUE(resumed.ok()) << resumed.status();
  ExpectAnnaIsBackSince(20 * kStepNs);
  ExpectSound();
}

TEST_F(ForgottenTest, AgentOfAnotherLogComesBackWithoutItsPast) {
  Commit(House());
  ASSERT_TRUE(Ingest(kNever, {}).ok());
  std::string rows = Rows();
  for (int step = kStepCount; step < kStepCount + 30; ++step) {
    absl::StrAppend(&rows, step, " 1 1 1\n", step, " 3 3 3\n");
  }
  log_ = folder_.Write("longer.txt", rows);
  const auto summary = Ingest(/*forget_at=*/0, {kAnna});
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(PoseCountOf(NodeId('H', 3)), kStepCount + 30);
  const Node anna = *Latest()->GetNode(kAnna);
  EXPECT_GE(*anna.first_observed_ns, kStepCount * kStepNs);
  EXPECT_EQ(anna.observation_count, PoseCountOf(kAnna));
  ExpectSound();
}

// A track that was told, then forgotten, and what the session says of it afterwards.
TEST_F(ForgottenTest, NothingOlderThanAReturnIsTold) {
  const auto view = MakeSnapshotMapView(Latest(), reader_);
  Forgotten forgotten(*view);
  GraphDelta first;
  Node& anna = first.nodes.emplace_back();
  anna.id = kAnna;
  anna.kind = kinds::kHuman;
  anna.layer = layers::kAgents;
  anna.first_observed_ns = 10;
  anna.agent.emplace();
  forgotten.Observe(first);
  forgotten.ObserveTaken(first);

  const auto pose_at = [](TimeNs time_ns) {
    TimedPose pose;
    pose.time_ns = time_ns;
    return pose;
  };
  GraphDelta second;
  second.appends = {{kAnna, {pose_at(100), pose_at(110)}}};
  const absl::Status refusal =
      MakeError(Reason::kDeltaInvalid, "refused", {{"missing_nodes", "H1 R7"}});
  EXPECT_FALSE(forgotten.Mend(MakeError(Reason::kDeltaInvalid, "other"), &second));
  ASSERT_TRUE(forgotten.Mend(refusal, &second));
  ASSERT_EQ(second.nodes.size(), 1u);
  EXPECT_EQ(second.nodes[0].first_observed_ns, 100);
  EXPECT_EQ(second.nodes[0].observation_count, 2);
  forgotten.ObserveTaken(second);

  GraphDelta third;
  third.corrections = {{kAnna, 0, 50, {pose_at(20)}},
                       {kAnna, 60, 120, {pose_at(70), pose_at(110)}}};
  third.factors = {{kAnna, {PoseFactor{}, PoseFactor{}}}};
  third.factors[0].factors[0].from_ns = 90;
  third.factors[0].factors[0].to_ns = 100;
  third.factors[0].factors[1].from_ns = 100;
  third.factors[0].factors[1].to_ns = 110;
  third.shapes.push_back({kAnna, std::nullopt, {BodyShape{}, BodyShape{}}});
  third.shapes[0].shapes[0].time_ns = 99;
  third.shapes[0].shapes[1].time_ns = 100;
  third.stays = {{kAnna, NodeId('p', 1), NodeId(), 0, 90},
                 {kAnna, NodeId('p', 1), NodeId(), 90, 120}};
  Edge& touched = third.edges.emplace_back();
  touched.source = kAnna;
  touched.target = NodeId('O', 1);
  touched.valid = {30, 40};
  ASSERT_TRUE(forgotten.LeaveOut(&third).ok());
  ASSERT_EQ(third.corrections.size(), 1u);
  EXPECT_EQ(third.corrections[0].from_ns, 100);
  EXPECT_EQ(third.corrections[0].poses.size(), 1u);
  ASSERT_EQ(third.factors.size(), 1u);
  EXPECT_EQ(third.factors[0].factors.size(), 1u);
  ASSERT_EQ(third.shapes.size(), 1u);
  EXPECT_EQ(third.shapes[0].shapes.size(), 1u);
  ASSERT_EQ(third.stays.size(), 1u);
  EXPECT_EQ(third.stays[0].enter_ns, 100);
  EXPECT_TRUE(third.edges.empty());
}

TEST_F(ForgottenTest, CorrectionOfATrackThatLostItsEndKeepsToWhatIsLeft) {
  Commit(House());
  ASSERT_TRUE(Ingest(kNever, {}).ok());
  GraphDelta cut;
  cut.is_forgetting = true;
  cut.corrections = {{kAnna, 50 * kStepNs, kTimeMax, {}}, {kBert, 0, kTimeMax, {}}};
  Commit(std::move(cut));
  const auto view = MakeSnapshotMapView(Latest(), reader_);
  Forgotten forgotten(*view);
  GraphDelta delta;
  delta.session_id = "moved by a loop closure";
  delta.sequence = 1;
  for (const NodeId agent : {kAnna, kBert}) {
    TrajectoryCorrection& item = delta.corrections.emplace_back();
    item = {agent, 0, 50 * kStepNs + 1, {}};
    for (const int step : {10, 49, 50}) item.poses.emplace_back().time_ns = step * kStepNs;
  }
  absl::StatusOr<CommitResult> result = writer_->Commit(delta);
  for (int tries = 0; tries < 3 && !result.ok(); ++tries) {
    ASSERT_TRUE(forgotten.Mend(result.status(), &delta)) << result.status();
    result = writer_->Commit(delta);
  }
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(PoseCountOf(kAnna), 2);
  EXPECT_EQ(PoseCountOf(kBert), 0);
  ExpectSound();
}

}  // namespace
}  // namespace dsg::ingest
