// SPDX-License-Identifier: Apache-2.0
// Stays in rooms that turned out to be others.
#include "ingest/presence/stay_mender.h"

#include <gtest/gtest.h>

#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

const NodeId kRobot('r', 0);

class StayMenderTest : public testing::Test {
 protected:
  StayMenderTest() {
    for (int i = 0; i <= 10; ++i) mender_.Observe(kRobot, 100 * i, {1.0 * i, 2.0, 0.0});
  }
  StayMender mender_;
};

TEST_F(StayMenderTest, LeavesStaysAloneWhoseRoomIsStillThere) {
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 0, 501}});
  EXPECT_TRUE(mender_.Mend(RegionIndex({MakeRoom(1, 0, 0, 3, 5)}, {}, {})).empty());
}

TEST_F(StayMenderTest, MovesStaysToTheRoomThatTheirMiddleIsIn) {
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 0, 501}});
  const RegionIndex regions({MakeRoom(2, 0, 0, 5, 5), MakeRoom(3, 5, 0, 11, 5)}, {}, {});
  const std::vector<Stay> mended = mender_.Mend(regions);
  ASSERT_EQ(mended.size(), 1u);
  EXPECT_EQ(mended[0], (Stay{kRobot, NodeId(), NodeId('R', 2), 0, 501}));
  EXPECT_TRUE(mender_.Mend(regions).empty()) << "told already";
}

TEST_F(StayMenderTest, MovesStaysWhosePlaceIsInAnotherRoomByNow) {
  Node place;
  place.id = NodeId('p', 4);
  place.layer = layers::kPlaces;
  place.kind = kinds::kPlace;
  place.map_T_node.position = {2.0, 2.0, 0.0};
  const std::vector<Node> rooms = {MakeRoom(1, 5, 0, 11, 5), MakeRoom(2, 0, 0, 5, 5)};
  mender_.Remember({{kRobot, place.id, NodeId('R', 1), 0, 501}});
  const std::vector<Stay> mended =
      mender_.Mend(RegionIndex(rooms, {place}, {{NodeId('R', 2), place.id}}));
  ASSERT_EQ(mended.size(), 1u);
  EXPECT_EQ(mended[0], (Stay{kRobot, place.id, NodeId('R', 2), 0, 501}));
  // As it was, where the place is in the room that the stay names.
  mender_.Remember({{kRobot, place.id, NodeId('R', 2), 0, 501}});
  EXPECT_TRUE(mender_.Mend(RegionIndex(rooms, {place}, {{NodeId('R', 2), place.id}})).empty());
}

TEST_F(StayMenderTest, GivesARoomToStaysThatHadNone) {
  mender_.Remember({{kRobot, NodeId('p', 1), NodeId(), 600, 1001}});
  const RegionIndex regions({MakeRoom(3, 5, 0, 11, 5)}, {MakePlace(1, 8, 2)}, {});
  const std::vector<Stay> mended = mender_.Mend(regions);
  ASSERT_EQ(mended.size(), 1u);
  EXPECT_EQ(mended[0].room, NodeId('R', 3));
}

// The poses of a stay go when it has ended, those of the next one remain.
TEST_F(StayMenderTest, MendsAgainAndAgainWhatEndedLongAgo) {
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 0, 501}});
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 501, 1001}});
  for (int i = 11; i <= 5000; ++i) mender_.Observe(kRobot, 100 * i, {900.0, 2.0, 0.0});
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 1001, 500'001}});
  for (const uint64_t room : {2, 3}) {
    const RegionIndex regions({MakeRoom(room, 0, 0, 5, 5), MakeRoom(room + 10, 5, 0, 11, 5)}, {},
                              {});
    const std::vector<Stay> mended = mender_.Mend(regions);
    ASSERT_EQ(mended.size(), 2u);
    EXPECT_EQ(mended[0], (Stay{kRobot, NodeId(), NodeId('R', room), 0, 501}));
    EXPECT_EQ(mended[1], (Stay{kRobot, NodeId(), NodeId('R', room + 10), 501, 1001}));
  }
}

TEST_F(StayMenderTest, LeavesOpenStaysAndThoseThatAreNowhereNow) {
  mender_.Remember({{kRobot, NodeId(), NodeId('R', 1), 0, 501},
                    {kRobot, NodeId(), NodeId('R', 1), 501, kTimeMax}});
  EXPECT_TRUE(mender_.Mend(RegionIndex({MakeRoom(9, 50, 50, 60, 60)}, {}, {})).empty());
}

}  // namespace
}  // namespace dsg::ingest
