// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Locate : public testing::Test {
 protected:
  Locate() { MakeOffice(folder_.path()); }

  v1::LocateAgentRequest Ask(const std::string& agent, TimeNs at_ns) {
    v1::LocateAgentRequest request;
    request.set_map(kMap);
    request.set_agent(agent);
    request.set_at_ns(at_ns);
    return request;
  }

  absl::StatusOr<v1::LocateAgentResponse> Get(const v1::LocateAgentRequest& request) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::LocateAgentResponse reply;
    const absl::Status status = core_->LocateAgent(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
};

TEST_F(Locate, InterpolatesBetweenStoredPosesAndNamesThem) {
  const auto reply = Get(Ask("H12", 2 * kSecond + kSecond / 4));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->quality(), v1::INTERPOLATED);
  EXPECT_NEAR(reply->pose().position().x(), 3.25, 1e-12);
  EXPECT_EQ(reply->before_ns(), 2 * kSecond);
  EXPECT_EQ(reply->after_ns(), 3 * kSecond);
  EXPECT_EQ(reply->agent_id(), "H12");
  EXPECT_EQ(reply->agent_name(), "12");
  EXPECT_FALSE(reply->orientation_unknown());
}

TEST_F(Locate, SaysExactAtAStoredPose) {
  const auto reply = Get(Ask("12", 3 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->quality(), v1::EXACT);
  EXPECT_EQ(reply->before_ns(), reply->after_ns());
  EXPECT_EQ(reply->pose().position().x(), 4.0);
}

TEST_F(Locate, GivesNoPoseInAGap) {
  const auto reply = Get(Ask("H12", 40 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->quality(), v1::IN_GAP);
  EXPECT_FALSE(reply->has_pose());
  EXPECT_EQ(reply->before_ns(), 18 * kSecond);
  EXPECT_EQ(reply->after_ns(), 60 * kSecond);
  EXPECT_EQ(reply->place_id(), "");
}

TEST_F(Locate, NamesPlaceRoomBuildingAndAllAncestorsNearestFirst) {
  const auto reply = Get(Ask("H12", 5 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->place_id(), "p2");
  EXPECT_EQ(reply->room_id(), "R1");
  EXPECT_EQ(reply->building_id(), "B1");
  ASSERT_EQ(reply->ancestor_ids_size(), 2);
  EXPECT_EQ(reply->ancestor_ids(0), "R1");
  EXPECT_EQ(reply->ancestor_ids(1), "B1");
}

TEST_F(Locate, KnowsACartAsWellAsAPerson) {
  GraphDelta delta;
  const NodeId cart('V', 1);
  delta.nodes = {MakeNode(cart, layers::kAgents, kinds::kVehicle, "cart", Box3d())};
  delta.nodes.back().agent.emplace();
  delta.appends = {{cart, {PoseAt(0, 2, 5, 0), PoseAt(2 * kSecond, 4, 5, 0)}}};
  delta.stays = {{cart, NodeId('p', 1), NodeId('R', 1), 0, kTimeMax}};
  CommitToOffice(folder_.path(), delta);
  const auto reply = Get(Ask("cart", kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->quality(), v1::INTERPOLATED);
  EXPECT_NEAR(reply->pose().position().x(), 3.0, 1e-12);
  EXPECT_EQ(reply->building_id(), "B1");
}

TEST_F(Locate, LeavesOutARoomThatNeverWas) {
  GraphDelta delta;
  const NodeId room('R', 1);
  delta.retirements = {{room, std::nullopt}};
  delta.edge_removals = {{NodeId('B', 1), relations::kContains, room},
                         {room, relations::kContains, NodeId('p', 1)},
                         {room, relations::kContains, NodeId('p', 2)}};
  CommitToOffice(folder_.path(), delta);
  const auto reply = Get(Ask("H12", 5 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->place_id(), "p2");
  EXPECT_EQ(reply->building_id(), "");
  EXPECT_EQ(reply->ancestor_ids_size(), 0);
}

TEST_F(Locate, LeavesTheHierarchyEmptyWhereNoStayIsKnown) {
  const auto reply = Get(Ask("spot", 5 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->quality(), v1::EXACT);
  EXPECT_EQ(reply->room_id(), "");
  EXPECT_EQ(reply->building_id(), "");
  EXPECT_EQ(reply->ancestor_ids_size(), 0);
}

TEST_F(Locate, SaysWhenTheOrientationMeansNothing) {
  const auto reply = Get(Ask("13", 5 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_TRUE(reply->orientation_unknown());
}

TEST_F(Locate, NeverExtrapolates) {
  for (const TimeNs at_ns : {-1 * kSecond, 63 * kSecond}) {
    const auto reply = Get(Ask("H12", at_ns));
    EXPECT_EQ(ReasonOf(reply.status()), Reason::kTimeOutsideTrack);
    EXPECT_EQ(MetadataOf(reply.status()).at("first_ns"), "0");
    EXPECT_EQ(MetadataOf(reply.status()).at("last_ns"), "62000000000");
  }
}

TEST_F(Locate, RefusesUnknownAgentsMapsAndNamesThatArePaths) {
  EXPECT_EQ(ReasonOf(Get(Ask("H99", 0)).status()), Reason::kAgentUnknown);
  EXPECT_EQ(ReasonOf(Get(Ask("", 0)).status()), Reason::kFieldInvalid);
  v1::LocateAgentRequest request = Ask("H12", 0);
  request.set_map("../office");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kMapNameInvalid);
  request.set_map("nowhere");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kMapUnknown);
}

TEST_F(Locate, RefusesARequestWithoutATimeAndTakesTimeZero) {
  v1::LocateAgentRequest request = Ask("H12", 0);
  EXPECT_TRUE(Get(request).ok());
  request.clear_at_ns();
  const absl::Status refused = Get(request).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid);
  EXPECT_EQ(MetadataOf(refused).at("field"), "at_ns");
  v1::BatchLocateAgentsRequest batch;
  batch.set_map(kMap);
  batch.add_instants()->set_agent("H12");
  v1::BatchLocateAgentsResponse reply;
  core_ = OpenCore(folder_.path());
  ASSERT_TRUE(core_->BatchLocateAgents(query::CallContext(), batch, &reply).ok());
  EXPECT_EQ(reply.results(0).status_code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
}

TEST_F(Locate, AnswersFromAnOldRevisionWhatWasBelievedThen) {
  GraphDelta moved;
  moved.corrections = {{NodeId('H', 12), 3 * kSecond, 4 * kSecond, {PoseAt(3 * kSecond, 4, 9, 1)}}};
  CommitToOffice(folder_.path(), std::move(moved));
  v1::LocateAgentRequest request = Ask("H12", 3 * kSecond);
  const auto now = Get(request);
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_EQ(now->pose().position().y(), 9.0);
  EXPECT_EQ(now->header().read_revision(), 2);

  request.mutable_read_at()->set_exact_revision(1);
  const auto then = Get(request);
  ASSERT_TRUE(then.ok()) << then.status();
  EXPECT_EQ(then->pose().position().y(), 5.0);
  EXPECT_EQ(then->header().read_revision(), 1);
  EXPECT_EQ(then->header().head_revision(), 2);
}

TEST_F(Locate, SeesCommitsOfAnotherConnectionAtOnce) {
  ASSERT_TRUE(Get(Ask("H12", 0)).ok());
  GraphDelta more;
  more.appends = {{NodeId('H', 12), {PoseAt(63 * kSecond, 19, 6, 1)}}};
  CommitToOffice(folder_.path(), std::move(more));
  const auto reply = Get(Ask("H12", 63 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->header().read_revision(), 2);
}

TEST_F(Locate, KnowsAnAgentByTheNameItHadAtTheRevision) {
  ASSERT_TRUE(Get(Ask("12", 0)).ok());
  GraphDelta renamed;
  renamed.nodes = {MakeNode(NodeId('H', 12), layers::kAgents, kinds::kHuman, "Ada", Box3d())};
  CommitToOffice(folder_.path(), std::move(renamed));
  EXPECT_EQ(ReasonOf(Get(Ask("12", 0)).status()), Reason::kAgentUnknown);
  EXPECT_TRUE(Get(Ask("Ada", 0)).ok());
  v1::LocateAgentRequest request = Ask("12", 0);
  request.mutable_read_at()->set_exact_revision(1);
  EXPECT_TRUE(Get(request).ok());
}

TEST_F(Locate, RefusesRevisionsThatAreNotThere) {
  v1::LocateAgentRequest request = Ask("H12", 0);
  request.mutable_read_at()->set_exact_revision(5);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kRevisionInFuture);
  request.mutable_read_at()->set_at_least_revision(5);
  const auto reply = Get(request);
  EXPECT_EQ(ReasonOf(reply.status()), Reason::kRevisionInFuture);
  EXPECT_EQ(MetadataOf(reply.status()).at("newest"), "1");
  request.mutable_read_at()->set_at_least_revision(1);
  EXPECT_TRUE(Get(request).ok());
  request.mutable_read_at()->set_exact_revision(-1);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
}

TEST_F(Locate, StopsWhenCancelledOrLate) {
  core_ = OpenCore(folder_.path());
  v1::LocateAgentResponse reply;
  query::CallContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(core_->LocateAgent(cancelled, Ask("H12", 0), &reply).code(),
            absl::StatusCode::kCancelled);
  const query::CallContext late(query::CallContext::Clock::now());
  EXPECT_EQ(core_->LocateAgent(late, Ask("H12", 0), &reply).code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST_F(Locate, BatchAnswersEveryPairAsTheSingleCallDoes) {
  core_ = OpenCore(folder_.path());
  v1::BatchLocateAgentsRequest request;
  request.set_map(kMap);
  for (const char* agent : {"H12", "12", "13", "spot", "H99", ""}) {
    for (TimeNs t = -1; t <= 64; ++t) {
      v1::AgentInstant* instant = request.add_instants();
      instant->set_agent(agent);
      instant->set_at_ns(t * kSecond + 1);
    }
  }
  v1::BatchLocateAgentsResponse reply;
  ASSERT_TRUE(core_->BatchLocateAgents(query::CallContext(), request, &reply).ok());
  ASSERT_EQ(reply.results_size(), request.instants_size());
  EXPECT_EQ(reply.header().read_revision(), 1);
  int answered_count = 0;
  for (int i = 0; i < reply.results_size(); ++i) {
    const v1::AgentInstant& instant = request.instants(i);
    const v1::LocateResult& result = reply.results(i);
    const auto single = Get(Ask(instant.agent(), instant.at_ns()));
    ASSERT_EQ(result.status_code(), static_cast<int>(single.status().code()));
    if (!single.ok()) {
      EXPECT_EQ(result.status_message(), std::string(single.status().message()));
      continue;
    }
    ++answered_count;
    EXPECT_EQ(result.agent_id(), single->agent_id());
    EXPECT_EQ(result.pose().SerializeAsString(), single->pose().SerializeAsString());
    EXPECT_EQ(result.has_pose(), single->has_pose());
    EXPECT_EQ(result.quality(), single->quality());
    EXPECT_EQ(result.place_id(), single->place_id());
    EXPECT_EQ(result.room_id(), single->room_id());
  }
  EXPECT_GT(answered_count, 100);
}

TEST_F(Locate, RefusesABatchOfMoreThanTenThousand) {
  core_ = OpenCore(folder_.path());
  v1::BatchLocateAgentsRequest request;
  request.set_map(kMap);
  for (int i = 0; i < 10'001; ++i) request.add_instants()->set_agent("H12");
  v1::BatchLocateAgentsResponse reply;
  const absl::Status status = core_->BatchLocateAgents(query::CallContext(), request, &reply);
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid);
  request.mutable_instants()->RemoveLast();
  EXPECT_TRUE(core_->BatchLocateAgents(query::CallContext(), request, &reply).ok());
}

TEST_F(Locate, CutsTheMessageOfAFailedPairAtAWholeCharacter) {
  core_ = OpenCore(folder_.path());
  v1::BatchLocateAgentsRequest request;
  request.set_map(kMap);
  std::string name;
  for (int i = 0; i < 500; ++i) name += "ü";
  request.add_instants()->set_agent(name);
  v1::BatchLocateAgentsResponse reply;
  ASSERT_TRUE(core_->BatchLocateAgents(query::CallContext(), request, &reply).ok());
  EXPECT_LE(reply.results(0).status_message().size(), 200u);
  v1::BatchLocateAgentsResponse parsed;
  EXPECT_TRUE(parsed.ParseFromString(reply.SerializeAsString()));
}

}  // namespace
}  // namespace dsg::test
