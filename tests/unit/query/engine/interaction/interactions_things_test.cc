// SPDX-License-Identifier: Apache-2.0
// What the map says of the thing itself: beside its old spot, found anew, in somebody's hand.
#include <cmath>

#include "tests/unit/query/engine/interaction/interactions_fixture.h"

namespace dsg::test {
namespace {

TEST_F(Interactions, TakeAThingThatIsBesideItsOldSpotForMoved) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  AddPerson(20, {3.0, 6.2, 1.0}, 110, 118, kMugAt + Eigen::Vector3d(0, 0, 0.7));
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).alternative(), "false_change");
  EXPECT_TRUE(HasEvidence(one.candidates(0), "moved"));
}

TEST_F(Interactions, BelieveAHandMoreThanAnotherThingBesideTheSpot) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  AddPerson(20, {3.0, 5.5, 1.0}, 113, 115, kMugAt + Eigen::Vector3d(0, 0, 0.1));
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  EXPECT_TRUE(HasEvidence(Alternative(one, "false_change"), "moved"));
}

TEST_F(Interactions, TakeAThingThatIsFoundAnewWhereItWasForNeverGone) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.1, 0, 0), 150, 0, 160);
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).alternative(), "false_change");
}

TEST_F(Interactions, DoNotTakeAThingThatCameBeforeTheOtherWasMissedForIt) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 125, 0, 150);
  EXPECT_FALSE(HasEvidence(Alternative(GetOne(), "false_change"), "moved"));
}

TEST_F(Interactions, DoNotTakeAThingForMovedThatCameFromElsewhere) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  EXPECT_TRUE(HasEvidence(Alternative(GetOne(), "false_change"), "moved"));
  AddObject(NodeId('O', 12), {15, 5, 0.8}, 20, 90, 80, NodeId('p', 3));
  AddEdge(NodeId('O', 11), relations::kSameAs, NodeId('O', 12), 0.9, Interval());
  EXPECT_FALSE(HasEvidence(Alternative(GetOne(), "false_change"), "moved"));
}

TEST_F(Interactions, DoNotTakeAThingForMovedThatSomebodyBrought) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  AddFarPerson(20, 100, 130);
  AddEdge(NodeId('O', 11), relations::kHeldBy, NodeId('H', 20), 0.9, Seconds(125, 135));
  EXPECT_FALSE(HasEvidence(Alternative(GetOne(), "false_change"), "moved"));
}

TEST_F(Interactions, NameWhoWasSeenWithTheObjectInHand) {
  AddMug();
  AddFarPerson(20, 120, 130);
  AddPerson(21, {3.0, 6.2, 1.0}, 110, 112);
  AddEdge(kMug, relations::kHeldBy, NodeId('H', 20), 0.9, Seconds(121, 129));
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  EXPECT_EQ(one.candidates(0).at_ns(), 121 * kSecond);
  ASSERT_TRUE(HasEvidence(one.candidates(0), "held"));
  const v1::Evidence& row = one.candidates(0).evidence(0);
  EXPECT_EQ(row.source(), "O10 HELD_BY H20");
  EXPECT_NEAR(row.log_weight(), std::log(0.9 / 0.1), 1e-9);
  EXPECT_FALSE(HasEvidence(Candidate(one, "p21"), "held"));
  EXPECT_TRUE(HasEvidence(Alternative(one, "false_change"), "held"));
}

TEST_F(Interactions, CountAHandAndTheObjectInItTogether) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  AddPerson(21, {3.0, 4.5, 1.0}, 121, 129, kMugAt);
  EXPECT_TRUE(GetOne().abstained());
  AddEdge(kMug, relations::kHeldBy, NodeId('H', 21), 0.9, Seconds(125, 139));
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p21");
  EXPECT_TRUE(HasEvidence(one.candidates(0), "held"));
  EXPECT_TRUE(HasEvidence(one.candidates(0), "hand_distance"));
}

TEST_F(Interactions, BelieveAHoldMoreThanAnotherThingBesideTheSpot) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  AddFarPerson(20, 120, 130);
  AddEdge(kMug, relations::kHeldBy, NodeId('H', 20), 0.9, Seconds(121, 129));
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  EXPECT_FALSE(HasEvidence(Alternative(one, "false_change"), "moved"));
}

TEST_F(Interactions, PassOverHoldsOfOtherTimesAndThoseThatAreUnlikely) {
  AddMug();
  AddFarPerson(20, 60, 200);
  for (const Interval& during : {Seconds(60, 90), Seconds(180, 190)}) {
    AddEdge(kMug, relations::kHeldBy, NodeId('H', 20), 0.9, during);
    EXPECT_FALSE(HasEvidence(Alternative(GetOne(), "false_change"), "held"));
  }
  AddEdge(kMug, relations::kHeldBy, NodeId('H', 20), 0.4, Seconds(121, 129));
  EXPECT_FALSE(HasEvidence(Alternative(GetOne(), "false_change"), "held"));
}

TEST_F(Interactions, NameWhoBroughtWhatIsSameAsAThingInHand) {
  AddObject(NodeId('O', 12), {15, 5, 0.8}, 20, 100, 80, NodeId('p', 3));
  AddObject(kMug, kMugAt, 140, 0, 150);
  AddFarPerson(20, 100, 136);
  AddEdge(NodeId('O', 12), relations::kHeldBy, NodeId('H', 20), 0.95, Seconds(90, 136));
  AddEdge(kMug, relations::kSameAs, NodeId('O', 12), 0.9, Interval());
  auto request = Ask();
  request.clear_types();
  request.add_types(v1::PLACED);
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->interactions_size(), 1);
  const v1::Interaction& one = reply->interactions(0);
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  ASSERT_TRUE(HasEvidence(one.candidates(0), "held"));
  EXPECT_EQ(one.candidates(0).evidence(0).source(), "O12 HELD_BY H20");
  EXPECT_NEAR(one.candidates(0).evidence(0).value(), 0.9, 1e-9);
}

TEST_F(Interactions, DoNotTakeALaterThingBesideTheOldSpotForIt) {
  AddMug();
  // Put there by somebody a minute after the mug was missed.
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 200, 0, 210);
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
}

}  // namespace
}  // namespace dsg::test
