// SPDX-License-Identifier: Apache-2.0
// Ages of policies where clocks disagree.
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "schema/model/known_names.h"
#include "schema/retention/graph_index.h"
#include "schema/retention/policy.h"
#include "tests/unit/schema/retention/prune_test_util.h"

namespace dsg::test {
namespace {

using P = PrunePolicy;

constexpr TimeNs kYear = 365 * kNsPerDay;
constexpr NodeId kRobot('H', 7);
constexpr NodeId kGuest('H', 8);

// Two agents and a thing, seen every day for a hundred days.
class ClockTest : public ::testing::Test {
 protected:
  explicit ClockTest(const MapSpec& spec = Spec(TrajectoryCodec::kLossless)) : map_(spec) {
    for (int day = 0; day < 100; ++day) {
      GraphDelta delta;
      if (day == 0) delta.nodes = {MakeHuman(7, "robot"), MakeHuman(8, "guest")};
      const TimeNs now_ns = map_.reader().spec().epoch_ns + day * kNsPerDay;
      delta.nodes.push_back(MakeObject(1, "thing", BoxOf(0, 0, 0, 1, 1, 1)));
      delta.nodes.back().last_observed_ns = now_ns;
      delta.appends = {{kRobot, {PoseAt(now_ns, 1, 1, 0)}}, {kGuest, {PoseAt(now_ns, 2, 1, 0)}}};
      map_.MustCommit(std::move(delta));
    }
  }
  ~ClockTest() override { EXPECT_EQ(map_.Problems(), ""); }

  TimeNs Day(double day) {
    return map_.reader().spec().epoch_ns + static_cast<TimeNs>(day * kNsPerDay);
  }

  int64_t PosesTaken(TimeNs age_ns, int64_t wall_now_ns = 0) {
    plan_ = OrDie(PlanPrune(&map_.reader(), *map_.Latest(), {PolicyOf(P::OlderThan{age_ns})},
                            {wall_now_ns}, StopCheck()));
    return plan_.total.pose_count;
  }

  void AddAgent(uint64_t index, std::vector<TimeNs> times_ns) {
    GraphDelta delta;
    delta.nodes = {MakeHuman(index, "other")};
    delta.appends = {{NodeId('H', index), {}}};
    for (const TimeNs time_ns : times_ns) {
      delta.appends[0].poses.push_back(PoseAt(time_ns, 3, 1, 0));
    }
    map_.MustCommit(std::move(delta));
  }

  TestMap map_;
  PrunePlan plan_;
};

TEST_F(ClockTest, ClocksThatAgreeAreAgedFromTheNewest) {
  EXPECT_EQ(PosesTaken(kNsPerDay * 30), 2 * 69);
  EXPECT_TRUE(plan_.implausible_agents.empty());
  EXPECT_TRUE(plan_.notes.empty());
}

TEST_F(ClockTest, OnePoseFiveYearsAheadTakesNobodysTrack) {
  map_.MustCommit(DeltaOfPoses(kGuest, {PoseAt(Day(99) + 5 * kYear, 2, 1, 0)}));
  EXPECT_EQ(PosesTaken(kNsPerDay * 30), 2 * 69);
  EXPECT_EQ(plan_.implausible_agents, std::vector<NodeId>{kGuest});
  ASSERT_EQ(plan_.notes.size(), 1u);
  EXPECT_TRUE(absl::StrContains(plan_.notes[0], "H8")) << plan_.notes[0];
  EXPECT_EQ(PosesTaken(kNsPerDay * 100), 0);
}

TEST_F(ClockTest, APoseThatIsAlsoANodeIsNoSecondWitness) {
  const TimeNs ahead_ns = Day(99) + 5 * kYear;
  GraphDelta delta;
  delta.layers = {{kAgentPoseLayer, "agent_poses", 200}};
  Node pose = MakeObject(3, "", BoxOf(0, 0, 0, 1, 1, 1));
  pose.object.reset();
  pose.kind = kAgentPoseKind;
  pose.layer = kAgentPoseLayer;
  pose.last_observed_ns = ahead_ns;
  delta.nodes = {pose};
  delta.appends = {{kGuest, {PoseAt(ahead_ns, 2, 1, 0)}}};
  map_.MustCommit(std::move(delta));
  EXPECT_EQ(PosesTaken(kNsPerDay * 30), 2 * 69);
  EXPECT_EQ(plan_.implausible_agents, std::vector<NodeId>{kGuest});
}

TEST_F(ClockTest, OneThingSeenFiveYearsAheadTakesNothing) {
  Node thing = MakeObject(2, "clock", BoxOf(0, 0, 0, 1, 1, 1));
  thing.last_observed_ns = Day(99) + 5 * kYear;
  map_.MustCommit(DeltaOfNodes({thing}));
  EXPECT_EQ(PosesTaken(kNsPerDay * 30), 2 * 69);
  const PrunePlan unseen = PlanOf(&map_, {PolicyOf(P::UnseenFor{30 * kNsPerDay})});
  EXPECT_TRUE(unseen.nodes.empty());
}

TEST_F(ClockTest, AnAgentYearsBehindIsAgedByItsOwnClock) {
  std::vector<TimeNs> times_ns;
  for (int day = 0; day < 20; ++day) times_ns.push_back(Day(day) - 4 * kYear);
  AddAgent(9, times_ns);
  EXPECT_EQ(PosesTaken(kNsPerDay * 30), 2 * 69);
  EXPECT_EQ(PosesTaken(kNsPerDay * 10), 2 * 89 + 9);
  // It goes like the others when time goes on.
  for (const int day : {105, 112, 119}) {
    GraphDelta delta = DeltaOfPoses(kRobot, {PoseAt(Day(day), 1, 1, 0)});
    delta.appends.push_back({kGuest, {PoseAt(Day(day), 2, 1, 0)}});
    map_.MustCommit(std::move(delta));
  }
  EXPECT_EQ(PosesTaken(kNsPerDay * 19), 2 * 100 + 20);
}

TEST_F(ClockTest, WhoLeftLongAgoIsForgotten) {
  AddAgent(9, {Day(99.5)});
  for (int day = 100; day < 200; ++day) {
    GraphDelta delta = DeltaOfPoses(kRobot, {PoseAt(Day(day), 1, 1, 0)});
    delta.appends.push_back({kGuest, {PoseAt(Day(day), 2, 1, 0)}});
    map_.MustCommit(std::move(delta));
  }
  EXPECT_EQ(PosesTaken(kNsPerDay * 90), 2 * 109 + 1);
  ASSERT_EQ(plan_.nodes.size(), 1u);
  EXPECT_EQ(plan_.nodes[0].id, NodeId('H', 9));
}

TEST_F(ClockTest, WhoLeftLongAgoIsForgottenThoughATagKeepsAnOlderRevision) {
  OrDie(map_.writer().SetTag("begin", 50, ""));
  AddAgent(9, {Day(99.5)});
  for (int day = 100; day < 200; ++day) {
    GraphDelta delta = DeltaOfPoses(kRobot, {PoseAt(Day(day), 1, 1, 0)});
    delta.appends.push_back({kGuest, {PoseAt(Day(day), 2, 1, 0)}});
    map_.MustCommit(std::move(delta));
  }
  OrDie(map_.writer().Compact(180, StopCheck(), Progress()));
  EXPECT_EQ(PosesTaken(kNsPerDay * 90), 2 * 109 + 1);
}

TEST_F(ClockTest, ALeapThatOthersShareIsBelieved) {
  GraphDelta delta = DeltaOfPoses(kRobot, {PoseAt(Day(300), 1, 1, 0)});
  delta.appends.push_back({kGuest, {PoseAt(Day(301), 2, 1, 0)}});
  map_.MustCommit(std::move(delta));
  EXPECT_EQ(PosesTaken(kNsPerDay * 250), 2 * 51);
  EXPECT_TRUE(plan_.implausible_agents.empty());
}

class UnixClockTest : public ClockTest {
 protected:
  static constexpr TimeNs kEpochNs = 1'704'067'200 * kNsPerSecond;
  static MapSpec UnixSpec() {
    MapSpec spec = Spec(TrajectoryCodec::kLossless);
    spec.clock = Clock::kUnix;
    spec.epoch_ns = kEpochNs;
    return spec;
  }
  UnixClockTest() : ClockTest(UnixSpec()) {}
};

TEST_F(UnixClockTest, ARobotAheadWithThePeopleAroundItIsNotLaterThanTheWallClock) {
  AddAgent(9, {Day(99) + 5 * kYear});
  AddAgent(10, {Day(99.01) + 5 * kYear});
  EXPECT_EQ(PosesTaken(kNsPerDay * 30, Day(99)), 2 * 69);
  EXPECT_EQ(plan_.implausible_agents, (std::vector<NodeId>{{'H', 9}, {'H', 10}}));
}

TEST_F(UnixClockTest, AMapOfSimulatedTimeIsAgedThoughTheWallClockIsBeforeIt) {
  EXPECT_EQ(PosesTaken(kNsPerDay * 30, Day(0) - 9 * kYear), 2 * 69);
  EXPECT_TRUE(plan_.implausible_agents.empty());
}

TEST_F(UnixClockTest, ObservationsYearsFromTheMapAreRefusedAndNamed) {
  Node thing = MakeObject(2, "clock", BoxOf(0, 0, 0, 1, 1, 1));
  thing.last_observed_ns = Day(0) + 11 * kYear;
  const auto refused = map_.Commit(DeltaOfNodes({thing}));
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kTimeImplausible);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(absl::StrContains(refused.status().message(), "last_observed_ns of node O2"))
      << refused.status();
  EXPECT_EQ(MetadataOf(refused.status())["time_ns"], std::to_string(*thing.last_observed_ns));
  thing.last_observed_ns = Day(99) + 5 * kYear;
  EXPECT_TRUE(map_.Commit(DeltaOfNodes({thing})).ok());
  const auto pose = map_.Commit(DeltaOfPoses(kRobot, {PoseAt(Day(99) + 20 * kYear, 0, 0, 0)}));
  EXPECT_EQ(ReasonOf(pose.status()), Reason::kTimeImplausible);
  thing.last_observed_ns = kTimeMax;
  EXPECT_EQ(ReasonOf(map_.Commit(DeltaOfNodes({thing})).status()), Reason::kDeltaInvalid);
}

TEST_F(ClockTest, LeapsOfTheWallClockMakeNoRevisionOld) {
  const auto revisions_taken = [&](int64_t wall_now_ns) {
    plan_ = OrDie(PlanPrune(&map_.reader(), *map_.Latest(),
                            {PolicyOf(P::HistoryOlderThan{kNsPerSecond * 3600})}, {wall_now_ns},
                            StopCheck()));
    return plan_.total.revision_count;
  };
  EXPECT_EQ(revisions_taken(WallClockNs() + 5 * kYear), 0);
  ASSERT_EQ(plan_.notes.size(), 1u);
  EXPECT_TRUE(absl::StrContains(plan_.notes[0], "after revision 100")) << plan_.notes[0];
  EXPECT_EQ(revisions_taken(WallClockNs() - 5 * kYear), 0);
  EXPECT_EQ(revisions_taken(WallClockNs() + 2 * kNsPerDay), 99);
  EXPECT_TRUE(plan_.notes.empty());
}

TEST_F(ClockTest, TellsTheShareThatGoesAndByWhichPolicy) {
  P old = PolicyOf(P::OlderThan{10 * kNsPerDay});
  old.name = "old";
  P older = PolicyOf(P::OlderThan{50 * kNsPerDay});
  older.name = "older";
  const PrunePlan plan = PlanOf(&map_, {older, old});
  EXPECT_DOUBLE_EQ(plan.share, 0.89);
  EXPECT_EQ(plan.share_policy, "old");
  P thin = PolicyOf(P::OlderThan{10 * kNsPerDay});
  thin.simplify_m = 0.1;
  EXPECT_EQ(PlanOf(&map_, {thin}).share, 0.0);
}

}  // namespace
}  // namespace dsg::test
