// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "dsg/v1/meetings.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

// A mug in R1 was last seen at 100 s and missed at 140 s.
constexpr NodeId kMug('O', 10);
const Eigen::Vector3d kMugAt(3.0, 5.0, 0.8);

class Interactions : public testing::Test {
 protected:
  Interactions() { MakeOffice(folder_.path()); }

  void AddObject(NodeId id, const Eigen::Vector3d& at, TimeNs from_s, TimeNs to_s, TimeNs seen_s,
                 NodeId place = NodeId('p', 1)) {
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.05);
    Node node = MakeNode(id, layers::kObjects, kinds::kObject, "", Box3d(at - half, at + half));
    node.class_name = "mug";
    node.valid = {from_s * kSecond, to_s == 0 ? kTimeMax : to_s * kSecond};
    node.last_observed_ns = seen_s * kSecond;
    node.observation_count = 5;
    Edge edge{place, relations::kContains, id};
    edge.valid = node.valid;
    delta_.edges.push_back(edge);
    delta_.nodes.push_back(std::move(node));
  }

  void AddMug(TimeNs missed_s = 140) { AddObject(kMug, kMugAt, 20, missed_s, 100); }

  // Stands at `at` from from_s to to_s, a pose each half second; the right hand is at `hand` in the
  // middle of that, and beside the body else.
  void AddPerson(uint64_t index, const Eigen::Vector3d& at, TimeNs from_s, TimeNs to_s,
                 std::optional<Eigen::Vector3d> hand = std::nullopt) {
    const NodeId agent('H', index);
    Node node =
        MakeNode(agent, layers::kAgents, kinds::kHuman, "p" + std::to_string(index), Box3d());
    delta_.nodes.push_back(node);
    TrajectoryAppend track{agent, {}};
    ShapeAppend shapes;
    shapes.agent = agent;
    const TimeNs middle_ns = (from_s + to_s) * kSecond / 2;
    for (TimeNs t = from_s * kSecond; t <= to_s * kSecond; t += kSecond / 2) {
      track.poses.push_back(PoseAt(t, at.x(), at.y(), at.z()));
      BodyShape shape;
      shape.time_ns = t;
      shape.joints.assign(72, 0.0F);
      if (hand.has_value() && std::abs(t - middle_ns) <= kSecond / 2) {
        for (int i = 0; i < 3; ++i) shape.joints[69 + i] = static_cast<float>((*hand - at)[i]);
      }
      shapes.shapes.push_back(shape);
    }
    delta_.appends.push_back(std::move(track));
    delta_.shapes.push_back(std::move(shapes));
    delta_.stays.push_back(
        {agent, NodeId('p', 1), NodeId('R', 1), from_s * kSecond, to_s * kSecond});
  }

  v1::ListInteractionsRequest Ask() {
    v1::ListInteractionsRequest request;
    request.set_map(kMap);
    request.set_object(ToString(kMug));
    request.set_from_ns(0);
    request.set_to_ns(1000 * kSecond);
    request.add_types(v1::PICKED);
    request.set_include_abstained(true);
    return request;
  }

  absl::StatusOr<v1::ListInteractionsResponse> Get(const v1::ListInteractionsRequest& request) {
    if (!delta_.nodes.empty()) CommitToOffice(folder_.path(), std::exchange(delta_, {}));
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::ListInteractionsResponse reply;
    const absl::Status status = core_->ListInteractions(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  v1::Interaction GetOne() {
    const auto reply = Get(Ask());
    EXPECT_TRUE(reply.ok()) << reply.status();
    if (!reply.ok() || reply->interactions_size() != 1) {
      ADD_FAILURE() << "not one interaction";
      return {};
    }
    double sum = 0.0;
    for (const auto& one : reply->interactions(0).candidates()) sum += one.probability();
    EXPECT_NEAR(sum, 1.0, 1e-9);
    return reply->interactions(0);
  }

  static bool HasEvidence(const v1::InteractionCandidate& candidate, const std::string& kind) {
    for (const auto& row : candidate.evidence()) {
      if (row.kind() == kind && !row.source().empty() && !row.detail().empty()) return true;
    }
    return false;
  }

  TempFolder folder_;
  GraphDelta delta_;
  std::unique_ptr<query::ServiceCore> core_;
};

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

TEST_F(Interactions, TakeAThingThatIsBesideItsOldSpotForMoved) {
  AddMug();
  AddObject(NodeId('O', 11), kMugAt + Eigen::Vector3d(0.6, 0, 0), 140, 0, 150);
  AddPerson(20, {3.0, 5.5, 1.0}, 110, 118, kMugAt + Eigen::Vector3d(0, 0, 0.3));
  const v1::Interaction one = GetOne();
  EXPECT_TRUE(one.abstained()) << one.DebugString();
  EXPECT_EQ(one.candidates(0).alternative(), "false_change");
  EXPECT_TRUE(HasEvidence(one.candidates(0), "moved"));
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
