// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "dsg/v1/meetings.pb.h"
#include "query/engine/interaction/encounters.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

class Encounters : public testing::Test {
 protected:
  Encounters() { MakeOffice(folder_.path()); }

  static v1::ListEncountersRequest Ask(TimeNs from_ns, TimeNs to_ns) {
    v1::ListEncountersRequest request;
    request.set_map(kMap);
    request.set_from_ns(from_ns);
    request.set_to_ns(to_ns);
    return request;
  }

  absl::StatusOr<v1::ListEncountersResponse> Get(const v1::ListEncountersRequest& request) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::ListEncountersResponse reply;
    const absl::Status status = core_->ListEncounters(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  static std::string Show(const v1::Encounter& one) {
    return one.agent_id() + " " + one.other_agent_id() + " " + std::to_string(one.from_ns()) + " " +
           std::to_string(one.to_ns()) + " " + std::to_string(one.distance_m_min()) + " " +
           std::to_string(one.closest_at_ns()) + "\n";
  }

  std::string ShowAll(v1::ListEncountersRequest request, int page_size) {
    std::string text;
    request.set_page_size(page_size);
    do {
      const auto reply = Get(request);
      EXPECT_TRUE(reply.ok()) << reply.status();
      if (!reply.ok()) return text;
      EXPECT_LE(reply->encounters_size(), page_size);
      for (const auto& one : reply->encounters()) text += Show(one);
      request.set_page_token(reply->next_page_token());
    } while (!request.page_token().empty());
    return text;
  }

  // Twenty people at random in both rooms, and a wall between the rooms but for its door.
  void AddCrowd(uint64_t seed) {
    Random random(seed, 0);
    GraphDelta delta;
    for (uint64_t i = 100; i < 120; ++i) {
      const NodeId agent('H', i);
      delta.nodes.push_back(
          MakeNode(agent, layers::kAgents, kinds::kHuman, std::to_string(i), Box3d()));
      delta.appends.push_back({agent, {}});
      Eigen::Vector3d at(random.Uniform(1, 19), random.Uniform(1, 9), 1);
      for (int t = 1000; t <= 1400; ++t) {
        if (t % 40 == static_cast<int>(i % 40)) t += 5;
        delta.appends.back().poses.push_back(
            PoseAt(t * kSecond + static_cast<TimeNs>(i), at.x(), at.y(), at.z()));
        at.x() = std::clamp(at.x() + random.Uniform(-1, 1), 0.5, 19.5);
        at.y() = std::clamp(at.y() + random.Uniform(-1, 1), 0.5, 9.5);
      }
    }
    for (uint64_t i = 0; i < 2; ++i) {
      const double y = i == 0 ? 0.0 : 6.0;
      delta.nodes.push_back(MakeStructure(i, "wall", {9.9, y, 0}, {10.1, y + 4, 3}));
    }
    CommitToOffice(folder_.path(), std::move(delta));
  }

  static Node MakeStructure(uint64_t index, const std::string& type, const Eigen::Vector3d& low,
                            const Eigen::Vector3d& high) {
    Node node = MakeNode(NodeId('S', index), layers::kStructures, kinds::kStructure,
                         type + " " + std::to_string(index), Box3d(low, high));
    node.structure = StructureInfo{type, Eigen::Vector3d::Zero(), 0.0, 0};
    return node;
  }

  // Two people walk along y at 1 m/s from 3000 s on, at x = 4.5 and 5.5, with tracks on the floor.
  static GraphDelta PairOnTheFloor() {
    GraphDelta delta;
    for (const uint64_t i : {1u, 2u}) {
      const NodeId agent('H', i);
      delta.nodes.push_back(
          MakeNode(agent, layers::kAgents, kinds::kHuman, "w" + std::to_string(i), Box3d()));
      delta.appends.push_back({agent, {}});
      for (int t = 0; t <= 9; ++t) {
        delta.appends.back().poses.push_back(
            PoseAt((3000 + t) * kSecond, i == 1 ? 4.5 : 5.5, 0.5 + t, t % 2 == 0 ? 0.04 : -0.04));
      }
    }
    return delta;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
};

TEST_F(Encounters, SaysWhoMetWhomWhereAndWhen) {
  // H12 passes H13 (x = 3) at 2 s and leaves its two metres at 4 s.
  const auto reply = Get(Ask(0, 100 * kSecond));
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->encounters_size(), 1);
  const v1::Encounter& one = reply->encounters(0);
  EXPECT_EQ(one.agent_name(), "12");
  EXPECT_EQ(one.other_agent_name(), "13");
  EXPECT_EQ(one.from_ns(), 2 * kSecond);
  EXPECT_EQ(one.to_ns(), 4 * kSecond);
  EXPECT_EQ(one.closest_at_ns(), 2 * kSecond);
  EXPECT_DOUBLE_EQ(one.distance_m_min(), 0.0);
  EXPECT_EQ(one.place_id(), "p1");
  EXPECT_EQ(one.room_id(), "R1");
  EXPECT_EQ(reply->observed_agent_count(), 3);
}

TEST_F(Encounters, ClipsToTheIntervalAndLeavesShortOnesOut) {
  auto request = Ask(3 * kSecond, 100 * kSecond);
  EXPECT_EQ(ShowAll(request, 10), "H12 H13 3000000000 4000000000 1.000000 3000000000\n");
  request.set_duration_ns_min(kSecond + 1);
  EXPECT_EQ(ShowAll(request, 10), "");
}

TEST_F(Encounters, PagesAndSlicesDoNotShow) {
  AddCrowd(21);
  for (const bool with_walls : {false, true}) {
    auto request = Ask(0, 2000 * kSecond);
    request.set_line_of_sight(with_walls);
    const std::string all = ShowAll(request, 1000);
    EXPECT_GT(std::count(all.begin(), all.end(), '\n'), 100);
    EXPECT_EQ(ShowAll(request, 7), all);
    const auto store = *GraphStore::Open(folder_.path(), {});
    const auto snapshot = *(*store->OpenMap(kMap))->Latest();
    const auto sight = *query::Sight::Make(*snapshot, {});
    query::EncounterQuestion question;
    question.during = {0, 2000 * kSecond};
    question.sight = with_walls ? sight.get() : nullptr;
    question.slice_pose_count = 137;
    const auto found = query::FindEncounters(*snapshot, question, {});
    ASSERT_TRUE(found.ok()) << found.status();
    std::string sliced;
    for (const auto& one : *found) {
      sliced += ToString(one.agent) + " " + ToString(one.other) + " " +
                std::to_string(one.meeting.during.from_ns) + " " +
                std::to_string(one.meeting.during.to_ns) + " " +
                std::to_string(one.meeting.distance_m_min) + " " +
                std::to_string(one.meeting.closest_ns) + "\n";
    }
    EXPECT_EQ(sliced, all);
  }
}

TEST_F(Encounters, OfOneAgentAreThoseOfAllThatNameIt) {
  AddCrowd(22);
  auto request = Ask(0, 2000 * kSecond);
  std::istringstream all(ShowAll(request, 1000));
  std::string expected;
  for (std::string line; std::getline(all, line);) {
    if (line.find("H107 ") != std::string::npos) expected += line + "\n";
  }
  request.set_agent("H107");
  EXPECT_EQ(ShowAll(request, 3), expected);
  EXPECT_FALSE(expected.empty());
}

TEST_F(Encounters, EndWhereAWallStandsBetween) {
  AddCrowd(23);
  GraphDelta delta;
  for (const uint64_t i : {1u, 2u}) {
    const NodeId agent('H', i);
    delta.nodes.push_back(
        MakeNode(agent, layers::kAgents, kinds::kHuman, "w" + std::to_string(i), Box3d()));
    delta.appends.push_back({agent, {}});
    // Side by side along the wall, one on each side; the door is from y = 4 to 6.
    for (int t = 0; t <= 9; ++t) {
      delta.appends.back().poses.push_back(
          PoseAt((3000 + t) * kSecond, i == 1 ? 9.5 : 10.5, 0.5 + t, 1));
    }
  }
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = Ask(3000 * kSecond, 3009 * kSecond);
  request.set_line_of_sight(true);
  const auto reply = Get(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  ASSERT_EQ(reply->encounters_size(), 1);
  EXPECT_NEAR(static_cast<double>(reply->encounters(0).from_ns() - 3000 * kSecond), 3.5e9, 2e6);
  EXPECT_NEAR(static_cast<double>(reply->encounters(0).to_ns() - 3000 * kSecond), 5.5e9, 2e6);
}

TEST_F(Encounters, AreNotCutByTheFloorThatTracksLieOn) {
  GraphDelta delta = PairOnTheFloor();
  delta.nodes.push_back(MakeStructure(50, "floor", {0, 0, -0.2}, {20, 10, 0}));
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = Ask(3000 * kSecond, 3009 * kSecond);
  const std::string all = ShowAll(request, 10);
  EXPECT_FALSE(all.empty());
  request.set_line_of_sight(true);
  request.set_sight_gap_ns_max(1);
  EXPECT_EQ(ShowAll(request, 10), all);
}

TEST_F(Encounters, GoOnBehindAPillarAndEndBehindAWall) {
  GraphDelta delta = PairOnTheFloor();
  // Out of sight for half a second from 2 s on, and for three seconds from 5 s on.
  delta.nodes.push_back(MakeStructure(50, "pillar", {4.9, 2.5, 0}, {5.1, 3.0, 3}));
  delta.nodes.push_back(MakeStructure(51, "wall", {4.9, 5.5, 0}, {5.1, 8.5, 3}));
  CommitToOffice(folder_.path(), std::move(delta));
  auto request = Ask(3000 * kSecond, 3009 * kSecond);
  request.set_line_of_sight(true);
  const auto spans = [&](TimeNs gap_ns) {
    request.set_sight_gap_ns_max(gap_ns);
    const auto reply = Get(request);
    EXPECT_TRUE(reply.ok()) << reply.status();
    std::vector<int64_t> tenths;
    for (const auto& one : reply->encounters()) {
      for (const TimeNs at_ns : {one.from_ns(), one.to_ns()}) {
        tenths.push_back((at_ns - 3000 * kSecond + kSecond / 20) / (kSecond / 10));
      }
    }
    return tenths;
  };
  using Spans = std::vector<int64_t>;
  EXPECT_EQ(spans(1), Spans({0, 20, 25, 50, 80, 90}));
  EXPECT_EQ(spans(0), Spans({0, 50, 80, 90}));
  EXPECT_EQ(spans(4 * kSecond), Spans({0, 90}));
}

TEST_F(Encounters, RefuseBadQuestions) {
  auto request = Ask(5, 5);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kTimeRangeInverted);
  request = Ask(0, kSecond);
  request.set_distance_m(-1);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request.set_distance_m(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kNumberNotFinite);
  request = Ask(0, kSecond);
  request.set_sight_gap_ns_max(-1);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request = Ask(0, kSecond);
  request.set_agent("nobody");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kAgentUnknown);
  request.set_agent("H12");
  request.set_other_agent("H12");
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid);
  request = Ask(0, kSecond);
  request.set_line_of_sight(true);
  EXPECT_EQ(ReasonOf(Get(request).status()), Reason::kFieldInvalid) << "a map without walls";
}

TEST_F(Encounters, StopAtTheDeadline) {
  query::CallContext call;
  call.Cancel();
  if (core_ == nullptr) core_ = OpenCore(folder_.path());
  v1::ListEncountersResponse reply;
  EXPECT_EQ(core_->ListEncounters(call, Ask(0, kSecond), &reply).code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace dsg::test
