// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/interaction/interactions_fixture.h"

namespace dsg::test {
namespace {

TEST_F(Interactions, NameWhoseHandWasAtTheObject) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  AddPerson(21, {6.0, 8.0, 1.0}, 105, 135);
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.type(), v1::PICKED);
  EXPECT_EQ(one.room_id(), "R1");
  EXPECT_EQ(one.earliest_ns(), 100 * kSecond);
  EXPECT_EQ(one.latest_ns(), 140 * kSecond);
  ASSERT_GE(one.candidates_size(), 4);
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  EXPECT_GT(one.candidates(0).probability(), 0.9);
  EXPECT_NEAR(static_cast<double>(one.candidates(0).at_ns()), 114e9, 1e9);
  for (const char* kind : {"hand_distance", "dwell", "visit_window"}) {
    EXPECT_TRUE(HasEvidence(one.candidates(0), kind)) << kind;
  }
}

TEST_F(Interactions, AbstainBetweenTwoWhoWereEquallyNear) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  AddPerson(21, {3.0, 4.5, 1.0}, 120, 128, kMugAt);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained());
  EXPECT_NEAR(one.candidates(0).probability(), one.candidates(1).probability(), 0.01);
  auto request = Ask();
  request.set_include_abstained(false);
  EXPECT_EQ(Get(request)->interactions_size(), 0);
}

TEST_F(Interactions, AbstainWhereNobodyWasSeenAllTheWhile) {
  AddMug(900);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained());
  EXPECT_EQ(one.candidates(0).alternative(), "unseen");
}

TEST_F(Interactions, DoNotAccuseSomebodyWhoOnlyStoodInTheRoom) {
  AddMug(900);
  AddPerson(20, {6.0, 9.0, 1.0}, 110, 130);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained());
  EXPECT_NE(one.candidates(0).agent_name(), "p20");
}

TEST_F(Interactions, CountWhereTheThingWasCarried) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118);
  AddPerson(21, {3.0, 4.5, 1.0}, 121, 129);
  const Eigen::Vector3d there(15, 5, 0.8);
  AddObject(NodeId('O', 12), there, 200, 0, 210, NodeId('p', 3));
  for (int t = 170; t <= 190; ++t) {
    delta_.appends[0].poses.push_back(PoseAt(t * kSecond, 15, 5.5, 1));
  }
  const v1::Interaction one = GetOne();
  EXPECT_FALSE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).agent_name(), "p20");
  EXPECT_TRUE(HasEvidence(one.candidates(0), "carried"));
}

TEST_F(Interactions, ShareTheEvidenceOfATrackThatIsPerhapsAnEarlierOne) {
  AddMug();
  AddPerson(20, {6.0, 9.0, 1.0}, 50, 60);
  AddPerson(22, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  Edge same{NodeId('H', 22), relations::kSameAs, NodeId('H', 20)};
  same.weight = 0.5;
  delta_.edges.push_back(same);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained());
  EXPECT_TRUE(HasEvidence(one.candidates(0), "identity"));
  EXPECT_TRUE(HasEvidence(one.candidates(1), "identity"));
}

// Comes from afar by 110 s, is not seen for 8 s, and is seen to leave.
TEST_F(Interactions, CountWhoMayHaveBeenThereWhileNobodyLooked) {
  AddMug();
  AddPerson(20, {6.0, 5.0, 1.0}, 106, 110);
  for (int t = 118; t <= 121; ++t) {
    delta_.appends[0].poses.push_back(PoseAt(t * kSecond, 6.0, 5.0, 1.0));
  }
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained()) << "seen by nobody within reach: " << one.DebugString();
  ASSERT_TRUE(HasCandidate(one, "p20"));
  EXPECT_TRUE(HasEvidence(Candidate(one, "p20"), "unobserved"));
  EXPECT_FALSE(HasEvidence(Candidate(one, "p20"), "dwell"));
}

TEST_F(Interactions, DoNotSuspectWhoWasTooFarAwayToComeAndGoUnseen) {
  AddMug();
  AddPerson(20, {9.5, 9.5, 1.0}, 90, 110);
  for (int t = 115; t <= 150; ++t) {
    delta_.appends[0].poses.push_back(PoseAt(t * kSecond, 9.5, 9.5, 1.0));
  }
  const v1::Interaction one = GetOne();
  ASSERT_TRUE(HasCandidate(one, "p20")) << "was in the room";
  EXPECT_FALSE(HasEvidence(Candidate(one, "p20"), "unobserved"));
  EXPECT_LT(Candidate(one, "p20").probability(), 0.05);
}

// Two seconds before the last look at the mug, two metres from it, and never again.
TEST_F(Interactions, CountWhoWasLostOnTheWayThere) {
  AddMug();
  AddPerson(20, {5.0, 5.0, 1.0}, 90, 98);
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained());
  ASSERT_TRUE(HasCandidate(one, "p20"));
  EXPECT_TRUE(HasEvidence(Candidate(one, "p20"), "unobserved"));
}

TEST_F(Interactions, DoNotHoldAGapAgainstAHandThatWasFarBeforeIt) {
  AddMug();
  // Beside the mug until 112 s and from 120 s on, hands at the body.
  AddPerson(20, {3.0, 6.0, 1.2}, 110, 112, kMugAt + Eigen::Vector3d(0, 1.0, 0.4));
  for (int t = 120; t <= 122; ++t) {
    delta_.appends[0].poses.push_back(PoseAt(t * kSecond, 3.0, 6.0, 1.2));
  }
  const v1::Interaction with_gap = GetOne();
  ASSERT_TRUE(HasCandidate(with_gap, "p20"));
  EXPECT_GT(Candidate(with_gap, "p20").probability(), 0.3) << with_gap.DebugString();
}

TEST_F(Interactions, JudgeEachVisitForItself) {
  AddMug(900);
  // Passed by long before; took it later, with a hand at it.
  AddPerson(20, {3.0, 6.0, 1.0}, 110, 114);
  for (int t = 700; t <= 704; ++t) {
    delta_.appends[0].poses.push_back(PoseAt(t * kSecond, 3.0, 5.5, 1.0));
    BodyShape shape;
    shape.time_ns = t * kSecond;
    shape.joints.assign(72, 0.0F);
    for (int i = 0; i < 3; ++i) {
      shape.joints[69 + i] = static_cast<float>((kMugAt - Eigen::Vector3d(3.0, 5.5, 1.0))[i]);
    }
    delta_.shapes[0].shapes.push_back(shape);
  }
  const v1::Interaction one = GetOne();
  ASSERT_TRUE(HasCandidate(one, "p20"));
  const v1::InteractionCandidate candidate = Candidate(one, "p20");
  for (const auto& row : candidate.evidence()) {
    if (row.kind() != "visit_window") continue;
    EXPECT_EQ(row.from_ns(), 700 * kSecond);
    EXPECT_EQ(row.to_ns(), 704 * kSecond);
  }
  EXPECT_EQ(candidate.at_ns(), 700 * kSecond);
}

TEST_F(Interactions, PreferWhoPutAThingJustBeforeItWasSeen) {
  AddObject(kMug, kMugAt, 140, 0, 150);
  AddPerson(20, {3.0, 5.5, 1.0}, 40, 48, kMugAt);
  AddPerson(21, {3.0, 4.5, 1.0}, 130, 138, kMugAt);
  auto request = Ask();
  request.clear_types();
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->interactions_size(), 1);
  EXPECT_EQ(reply->interactions(0).candidates(0).agent_name(), "p21");
  EXPECT_TRUE(HasEvidence(reply->interactions(0).candidates(0), "delay"));
}

TEST_F(Interactions, DoNotCallPutWhatARobotSawAsSoonAsItCameNear) {
  AddObject(kMug, kMugAt, 140, 0, 150);
  AddRobot(kMugAt + Eigen::Vector3d(2.0, 0, 0), 135, 160);
  auto request = Ask();
  request.clear_types();
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->interactions_size(), 0) << reply->DebugString();
}

TEST_F(Interactions, ThinkMoreOfUnseenPeopleWhileTheRobotWasElsewhere) {
  AddMug(300);
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 112);
  const double watched = Alternative(GetOne(), "unseen").probability();
  AddRobot({18.0, 5.0, 0.0}, 0, 400);
  const double alone = Alternative(GetOne(), "unseen").probability();
  EXPECT_GT(alone, 1.5 * watched);
}

TEST_F(Interactions, ReportWhatWasPut) {
  AddObject(kMug, kMugAt, 140, 0, 150);
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  auto request = Ask();
  request.clear_types();
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->interactions_size(), 1);
  EXPECT_EQ(reply->interactions(0).type(), v1::PLACED);
  EXPECT_EQ(reply->interactions(0).candidates(0).agent_name(), "p20");
}

TEST_F(Interactions, FilterByAgentRoomClassAndTime) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  AddPerson(21, {6.0, 8.0, 1.0}, 105, 135);
  const auto count = [&](auto change) {
    auto request = Ask();
    request.clear_object();
    request.set_include_abstained(false);
    change(&request);
    const auto reply = Get(request);
    EXPECT_TRUE(reply.ok()) << reply.status();
    return reply.ok() ? reply->interactions_size() : -1;
  };
  EXPECT_EQ(count([](auto*) {}), 1);
  EXPECT_EQ(count([](auto* request) { request->set_agent("p20"); }), 1);
  EXPECT_EQ(count([](auto* request) { request->set_agent("p21"); }), 0);
  EXPECT_EQ(count([](auto* request) { request->set_node_id("R1"); }), 1);
  EXPECT_EQ(count([](auto* request) { request->set_node_id("HQ"); }), 1);
  EXPECT_EQ(count([](auto* request) { request->set_node_id("R2"); }), 0);
  EXPECT_EQ(count([](auto* request) { request->set_class_name("mug"); }), 1);
  EXPECT_EQ(count([](auto* request) { request->set_class_name("book"); }), 0);
  EXPECT_EQ(count([](auto* request) { request->set_from_ns(141 * kSecond); }), 0);
}

TEST_F(Interactions, HonourTheRevision) {
  AddMug();
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt);
  EXPECT_FALSE(GetOne().abstained());
  auto request = Ask();
  request.clear_object();
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_EQ(Get(request)->interactions_size(), 0);
}

TEST_F(Interactions, RefuseBadQuestions) {
  auto request = Ask();
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kNodeUnknown);
  request.set_object("R1");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request.clear_object();
  request.set_agent("nobody");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kAgentUnknown);
  request.clear_agent();
  request.add_types(v1::INTERACTION_TYPE_UNSPECIFIED);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request.clear_types();
  request.set_to_ns(0);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kTimeRangeInverted);
}

}  // namespace
}  // namespace dsg::test
