// SPDX-License-Identifier: Apache-2.0
// Stays from poses, on hand-made rooms.
#include "ingest/presence/stay_tracker.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

const NodeId kBerta('H', 2);

RegionIndex TwoRoomRegions() {
  return RegionIndex({MakeRoom(1, 0, 0, 5, 5), MakeRoom(2, 5, 0, 10, 5)}, {}, {});
}

Stay InRoom(NodeId agent, uint64_t room, TimeNs enter_ns, TimeNs exit_ns) {
  return {agent, NodeId(), NodeId('R', room), enter_ns, exit_ns};
}

TEST(StayTracker, EndsAndBeginsStaysAtThePoseThatIsFirstElsewhere) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 100, {4, 2, 0});
  tracker.Observe(kAnna, 200, {5.1, 2, 0});
  tracker.Observe(kAnna, 300, {6, 2, 0});
  tracker.Observe(kAnna, 400, {7, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(),
            (std::vector<Stay>{InRoom(kAnna, 1, 100, 300), InRoom(kAnna, 2, 300, 401)}));
}

TEST(StayTracker, TellsAnOpenStayOnceAndItsEndLater) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 100, {4, 2, 0});
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, kTimeMax)});
  tracker.Observe(kAnna, 200, {4, 2, 0});
  EXPECT_TRUE(tracker.TakeChanges().empty());
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, 201)});
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(StayTracker, EndsAStayAfterTheLastPoseBeforeAGap) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 0, {4, 2, 0});
  tracker.Observe(kAnna, 2 * kNsPerSecond, {4, 2, 0});
  tracker.Observe(kAnna, 4 * kNsPerSecond + 1, {4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(),
            (std::vector<Stay>{InRoom(kAnna, 1, 0, 2 * kNsPerSecond + 1),
                               InRoom(kAnna, 1, 4 * kNsPerSecond + 1, 4 * kNsPerSecond + 2)}));
}

TEST(StayTracker, KeepsStaysInRoomsThatAreStillThereWhenTheMapGrows) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 100, {4, 2, 0});
  tracker.SetRegions(RegionIndex({MakeRoom(0, -5, 0, 0, 5), MakeRoom(1, 0, 0, 5, 5)}, {}, {}));
  tracker.Observe(kAnna, 200, {4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, 201)});
}

TEST(StayTracker, EndsStaysInRoomsThatAreNoMore) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 100, {4, 2, 0});
  tracker.SetRegions(RegionIndex({MakeRoom(7, 0, 0, 10, 5)}, {}, {}));
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, 101)});
  tracker.Observe(kAnna, 200, {4, 2, 0});
  tracker.Finish();
  // Nobody is nowhere while rooms are told anew.
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 7, 101, 201)});
}

TEST(StayTracker, EndsStaysInRoomsThatAreNoMoreBeforeAGapToo) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 100, {4, 2, 0});
  tracker.SetRegions(RegionIndex({MakeRoom(7, 0, 0, 10, 5)}, {}, {}));
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, 101)});
  tracker.Observe(kAnna, 10 * kNsPerSecond, {4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(),
            std::vector<Stay>{InRoom(kAnna, 7, 10 * kNsPerSecond, 10 * kNsPerSecond + 1)});
}

TEST(StayTracker, ForgetsTheRoomOverAGap) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 0, {4, 2, 0});
  // Within the hysteresis of room 1, but nothing says that it was left lately.
  tracker.Observe(kAnna, 10 * kNsPerSecond, {5.1, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges().back(),
            InRoom(kAnna, 2, 10 * kNsPerSecond, 10 * kNsPerSecond + 1));
}

TEST(StayTracker, MakesNoStayNowhere) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 0, {-4, 2, 0});
  tracker.Observe(kAnna, 100, {1, 2, 0});
  tracker.Observe(kAnna, 200, {-4, 2, 0});
  tracker.Observe(kAnna, 300, {-4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(), std::vector<Stay>{InRoom(kAnna, 1, 100, 200)});
}

TEST(StayTracker, CutsStaysAtTheLongestLength) {
  StayTracker tracker(TwoRoomRegions(), 3600 * kNsPerSecond);
  const TimeNs step = kStayNsMax / 2;
  for (int i = 0; i <= 5; ++i) tracker.Observe(kAnna, i * step, {4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(),
            (std::vector<Stay>{InRoom(kAnna, 1, 0, kStayNsMax),
                               InRoom(kAnna, 1, kStayNsMax, 2 * kStayNsMax),
                               InRoom(kAnna, 1, 2 * kStayNsMax, 5 * step + 1)}));
}

TEST(StayTracker, SaysNothingInAMapWithoutRoomsAndPlaces) {
  StayTracker tracker(RegionIndex(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, 0, {4, 2, 0});
  tracker.Finish();
  EXPECT_TRUE(tracker.TakeChanges().empty());
}

TEST(StayTracker, WorksAtTheEndsOfTime) {
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  tracker.Observe(kAnna, kTimeMin + 1, {4, 2, 0});
  tracker.Observe(kAnna, kTimeMax - 2, {4, 2, 0});
  tracker.Finish();
  EXPECT_EQ(tracker.TakeChanges(),
            (std::vector<Stay>{InRoom(kAnna, 1, kTimeMin + 1, kTimeMin + 2),
                               InRoom(kAnna, 1, kTimeMax - 2, kTimeMax - 1)}));
}

// The newest word on each stay.
using StayTable = std::map<std::pair<NodeId, TimeNs>, Stay>;

StayTable WalkAskingEvery(int ask_every, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> step(0.0, 0.8);
  StayTracker tracker(TwoRoomRegions(), 2 * kNsPerSecond);
  StayTable table;
  const auto ask = [&] {
    for (const Stay& stay : tracker.TakeChanges()) table[{stay.agent, stay.enter_ns}] = stay;
  };
  std::map<NodeId, Eigen::Vector3d> at = {{kAnna, {2, 2, 0}}, {kBerta, {7, 2, 0}}};
  TimeNs time_ns = 0;
  for (int i = 0; i < 4000; ++i) {
    time_ns += random() % 50 == 0 ? 3 * kNsPerSecond : kNsPerSecond / 10;
    for (auto& [agent, position] : at) {
      position += Eigen::Vector3d(step(random), step(random), 0.0);
      position = position.cwiseMax(Eigen::Vector3d(-2, -2, 0)).cwiseMin(Eigen::Vector3d(12, 7, 0));
      tracker.Observe(agent, time_ns, position);
    }
    if (i % ask_every == 0) ask();
  }
  tracker.Finish();
  ask();
  return table;
}

TEST(StayTracker, SaysTheSameHoweverOftenItIsAsked) {
  constexpr unsigned kSeed = 42;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  const StayTable expected = WalkAskingEvery(4000, kSeed);
  EXPECT_GT(expected.size(), 100u);
  for (const int ask_every : {1, 2, 7, 100, 1999}) {
    EXPECT_EQ(WalkAskingEvery(ask_every, kSeed), expected) << ask_every;
  }
  TimeNs last_exit_ns = kTimeMin;
  for (const auto& [key, stay] : expected) {
    if (stay.agent == kBerta) break;
    EXPECT_LE(last_exit_ns, stay.enter_ns);
    EXPECT_LT(stay.enter_ns, stay.exit_ns);
    last_exit_ns = stay.exit_ns;
  }
}

}  // namespace
}  // namespace dsg::ingest
