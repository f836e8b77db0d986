// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Presence : public testing::Test {
 protected:
  Presence() { MakeOffice(folder_.path()); }

  v1::ListPresenceRequest Ask(const std::string& node, TimeNs from_ns, TimeNs to_ns) {
    v1::ListPresenceRequest request;
    request.set_map(kMap);
    if (!node.empty()) request.set_node_id(node);
    request.set_from_ns(from_ns);
    request.set_to_ns(to_ns);
    return request;
  }

  absl::StatusOr<v1::ListPresenceResponse> Get(const v1::ListPresenceRequest& request) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::ListPresenceResponse reply;
    const absl::Status status = core_->ListPresence(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  // "agent node enter exit" in seconds, one line an interval.
  static std::string Show(const v1::ListPresenceResponse& reply) {
    std::string text;
    for (const auto& interval : reply.intervals()) {
      text += interval.agent_id() + " " + interval.node_id() + " " +
              std::to_string(interval.enter_ns() / kSecond) + " " +
              std::to_string(interval.exit_ns() / kSecond) + "\n";
    }
    return text;
  }

  std::string ShowAll(v1::ListPresenceRequest request, int page_size) {
    std::string text;
    request.set_page_size(page_size);
    do {
      const auto reply = Get(request);
      EXPECT_TRUE(reply.ok()) << reply.status();
      if (!reply.ok()) return text;
      EXPECT_LE(reply->intervals_size(), page_size);
      text += Show(*reply);
      request.set_page_token(reply->next_page_token());
    } while (!request.page_token().empty());
    return text;
  }

  // Twenty people change between places at random; many enter at the same instant.
  void AddCrowd(unsigned seed) {
    std::mt19937 random(seed);
    GraphDelta delta;
    for (uint64_t i = 100; i < 120; ++i) {
      const NodeId agent('H', i);
      delta.nodes.push_back(
          MakeNode(agent, layers::kAgents, kinds::kHuman, std::to_string(i), Box3d()));
      delta.appends.push_back({agent, {}});
      for (int t = 100; t <= 160; ++t) {
        const double x = std::uniform_real_distribution<double>(0, 20)(random);
        delta.appends.back().poses.push_back(PoseAt(t * kSecond, x, 5, 1));
      }
      for (TimeNs t = 100; t < 160;) {
        const uint64_t place = 1 + random() % 3;
        const TimeNs end = t + 1 + static_cast<TimeNs>(random() % 4);
        delta.stays.push_back({agent, NodeId('p', place), NodeId('R', place == 3 ? 2 : 1),
                               t * kSecond, end * kSecond});
        t = end + static_cast<TimeNs>(random() % 2);
      }
    }
    CommitToOffice(folder_.path(), std::move(delta));
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
};

TEST_F(Presence, MergesTheStaysOfOneVisitAndClipsThemToTheInterval) {
  const auto reply = Get(Ask("R1", kSecond, 8 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(Show(*reply), "H12 R1 1 8\nH13 R1 2 8\n");
  EXPECT_EQ(reply->intervals(0).agent_name(), "12");
  EXPECT_EQ(reply->next_page_token(), "");
}

TEST_F(Presence, AnswersForAPlaceAlone) {
  const auto reply = Get(Ask("p1", 0, 100 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(Show(*reply), "H12 p1 0 4\nH13 p1 2 12\n");
}

TEST_F(Presence, AnswersForABuildingByItsRooms) {
  const auto reply = Get(Ask("HQ", 0, 20 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(Show(*reply), "H12 R1 0 9\nH13 R1 2 12\nH12 R2 9 19\n");
}

TEST_F(Presence, ClosesAnOpenStayAtTheLastPose) {
  const auto reply = Get(Ask("R2", 50 * kSecond, 1000 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(Show(*reply), "H12 R2 60 62\n");
}

TEST_F(Presence, AnswersForABoxByInterpolatedPosition) {
  v1::ListPresenceRequest request = Ask("", 0, 100 * kSecond);
  v1::Box* box = request.mutable_box();
  box->mutable_min()->set_x(2.5);
  box->mutable_max()->set_x(4.5);
  box->mutable_max()->set_y(10);
  box->mutable_max()->set_z(3);
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->intervals_size(), 2);
  EXPECT_EQ(reply->intervals(0).agent_id(), "H12");
  EXPECT_NEAR(static_cast<double>(reply->intervals(0).enter_ns()), 1.5e9, 2);
  EXPECT_NEAR(static_cast<double>(reply->intervals(0).exit_ns()), 3.5e9, 2);
  EXPECT_EQ(reply->intervals(1).agent_id(), "H13");
  EXPECT_EQ(reply->intervals(0).node_id(), "");
}

TEST_F(Presence, CountsTheAgentsThatWereObservedAtAll) {
  const auto early = Get(Ask("R2", 0, 20 * kSecond));
  ASSERT_TRUE(early.ok()) << early.status();
  EXPECT_EQ(early->observed_agent_count(), 3);
  const auto night = Get(Ask("R2", 30 * kSecond, 40 * kSecond));
  ASSERT_TRUE(night.ok()) << night.status();
  EXPECT_EQ(night->observed_agent_count(), 0);
}

TEST_F(Presence, GivesTheSameAnswerWhateverThePageSize) {
  constexpr unsigned kSeed = 20200711;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  AddCrowd(kSeed);
  v1::ListPresenceRequest boxed = Ask("", 100 * kSecond, 150 * kSecond);
  boxed.mutable_box()->mutable_min()->set_x(3);
  boxed.mutable_box()->mutable_max()->set_x(9);
  boxed.mutable_box()->mutable_max()->set_y(10);
  boxed.mutable_box()->mutable_max()->set_z(3);
  for (const auto& request :
       {Ask("B1", 0, 200 * kSecond), Ask("p2", 103 * kSecond, 150 * kSecond), boxed}) {
    const std::string whole = ShowAll(request, 1000);
    EXPECT_GT(whole.size(), 100u);
    for (const int page_size : {1, 2, 7, 50}) EXPECT_EQ(ShowAll(request, page_size), whole);
  }
}

TEST_F(Presence, ReadsTheRevisionOfTheFirstPageThoughOthersCommit) {
  v1::ListPresenceRequest request = Ask("B1", 0, 100 * kSecond);
  const std::string whole = ShowAll(request, 1000);
  request.set_page_size(1);
  auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  std::string paged = Show(*reply);
  AddCrowd(1);
  while (!reply->next_page_token().empty()) {
    request.set_page_token(reply->next_page_token());
    reply = Get(request);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->header().read_revision(), 1);
    EXPECT_EQ(reply->header().head_revision(), 2);
    paged += Show(*reply);
  }
  EXPECT_EQ(paged, whole);
}

TEST_F(Presence, RefusesATokenForAChangedQuestion) {
  v1::ListPresenceRequest request = Ask("B1", 0, 100 * kSecond);
  request.set_page_size(1);
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  request.set_page_token(reply->next_page_token());
  request.set_page_size(2);
  EXPECT_TRUE(Get(request).ok());
  request.set_to_ns(99 * kSecond);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kPageTokenMismatch);
}

TEST_F(Presence, RefusesBadRequests) {
  EXPECT_EQ(ReasonOf(Get(Ask("R1", 5, 5)).status()), Reason::kTimeRangeInverted);
  EXPECT_EQ(ReasonOf(Get(Ask("", 0, 5)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Get(Ask("O1", 0, 5)).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(Get(Ask("R9", 0, 5)).status()), Reason::kNodeUnknown);
  v1::ListPresenceRequest request = Ask("R1", 0, 5);
  request.set_page_size(-1);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request = Ask("", 0, 5);
  request.mutable_box()->mutable_min()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kNumberNotFinite);
  request.mutable_box()->mutable_min()->set_x(1);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kBoxInverted);
}

}  // namespace
}  // namespace dsg::test
