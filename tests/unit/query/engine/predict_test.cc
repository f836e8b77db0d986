// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "dsg/v1/read.pb.h"
#include "dsg/v1/space.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

constexpr double kClearanceM = 0.8;

Edge Relation(NodeId source, const char* relation, NodeId target) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  edge.weight = kClearanceM;
  return edge;
}

void AddPlace(GraphDelta* delta, uint64_t number, NodeId room, double x, double y) {
  const Eigen::Vector3d centre(x, y, 1.0);
  Node node = MakeNode(NodeId('p', number), layers::kPlaces, kinds::kPlace, "",
                       Box3d(centre, centre + Eigen::Vector3d::Constant(1e-3)));
  node.place = PlaceInfo();
  node.place->clearance_m = kClearanceM;
  delta->nodes.push_back(std::move(node));
  delta->edges.push_back(Relation(room, relations::kContains, NodeId('p', number)));
}

void Link(GraphDelta* delta, uint64_t a, uint64_t b) {
  delta->edges.push_back(Relation(NodeId('p', a), relations::kTraversable, NodeId('p', b)));
}

TrajectoryAppend Walk(NodeId agent, int from_tenths, int to_tenths) {
  TrajectoryAppend walk{agent, {}};
  for (int i = from_tenths; i <= to_tenths; i += 2) {
    walk.poses.push_back(PoseAt(i * (kSecond / 10), 0.1 * i, 0.0, 1.0));
  }
  return walk;
}

/// A T of places: p100 to p110 along y = 0 at x = 100 to 110 (room R10), an arm up to y = 8 (p111
/// to p118, R11) and one down to y = -8 (p121 to p128, R12), all with 0.8 m of clearance. The link
/// p110 - p121 ends at 105 s. A chair O10 is at the end of the upper arm. H20 walks along at 1 m /
/// s from 100 s on, where x = t; H21 does the same at y = 300, where nothing is.
GraphDelta TDelta() {
  GraphDelta delta;
  delta.author = "test";
  for (const uint64_t room : {10, 11, 12}) {
    delta.nodes.push_back(MakeNode(NodeId('R', room), layers::kRooms, kinds::kRoom, "", Box3d()));
  }
  for (int i = 0; i <= 10; ++i) AddPlace(&delta, 100 + i, NodeId('R', 10), 100.0 + i, 0.0);
  for (int i = 0; i < 10; ++i) Link(&delta, 100 + i, 101 + i);
  for (int i = 1; i <= 8; ++i) {
    AddPlace(&delta, 110 + i, NodeId('R', 11), 110.0, i);
    AddPlace(&delta, 120 + i, NodeId('R', 12), 110.0, -i);
    Link(&delta, i == 1 ? 110 : 109 + i, 110 + i);
    Link(&delta, i == 1 ? 110 : 119 + i, 120 + i);
    if (i == 1) delta.edges.back().valid.to_ns = 105 * kSecond;
  }
  Node chair = MakeNode(NodeId('O', 10), layers::kObjects, kinds::kObject, "",
                        Box3d(Eigen::Vector3d(109.7, 8.2, 0.0), Eigen::Vector3d(110.3, 8.8, 1.0)));
  chair.class_name = "office chair";
  delta.nodes.push_back(chair);
  delta.nodes.push_back(
      MakeNode(NodeId('H', 20), layers::kAgents, kinds::kHuman, "walker", Box3d()));
  delta.nodes.push_back(MakeNode(NodeId('H', 21), layers::kAgents, kinds::kHuman, "", Box3d()));
  TrajectoryAppend outside = Walk(NodeId('H', 21), 1000, 1060);
  for (TimedPose& pose : outside.poses) pose.map_T_agent.position.y() = 300.0;
  delta.appends = {Walk(NodeId('H', 20), 1000, 1060), outside};
  return delta;
}

class Predict : public testing::Test {
 protected:
  Predict() {
    MakeOffice(folder_.path());
    CommitToOffice(folder_.path(), TDelta());
  }

  static v1::PredictAgentRequest Ask(const std::string& agent) {
    v1::PredictAgentRequest request;
    request.set_map(kMap);
    request.set_agent(agent);
    return request;
  }

  static v1::PredictAgentRequest AskFrom(const std::string& agent, double from_s) {
    v1::PredictAgentRequest request = Ask(agent);
    request.set_from_ns(std::llround(from_s * 1e9));
    return request;
  }

  absl::StatusOr<v1::PredictAgentResponse> Get(const v1::PredictAgentRequest& request) {
    if (core_ == nullptr) core_ = OpenCore(folder_.path());
    v1::PredictAgentResponse reply;
    const absl::Status status = core_->PredictAgent(query::CallContext(), request, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  v1::PredictAgentResponse MustGet(const v1::PredictAgentRequest& request) {
    const auto reply = Get(request);
    EXPECT_TRUE(reply.ok()) << reply.status();
    return reply.ok() ? *reply : v1::PredictAgentResponse();
  }

  void ExpectRefused(const v1::PredictAgentRequest& request, Reason reason,
                     const std::string& field) {
    const auto reply = Get(request);
    ASSERT_FALSE(reply.ok()) << request.ShortDebugString();
    EXPECT_EQ(ReasonOf(reply.status()), reason) << reply.status();
    if (!field.empty()) {
      EXPECT_EQ(MetadataOf(reply.status())["field"], field) << reply.status();
    }
  }

  static bool IsInT(const v1::Vector3& position) {
    const bool in_bar = std::abs(position.y()) <= kClearanceM && position.x() <= 110.8;
    return in_bar || std::abs(position.x() - 110.0) <= kClearanceM;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
};

TEST_F(Predict, OffersBothArmsAndStaysOutOfTheWalls) {
  v1::PredictAgentRequest request = AskFrom("walker", 104.9);
  request.set_horizon_ns(10 * kSecond);
  const v1::PredictAgentResponse reply = MustGet(request);
  EXPECT_EQ(reply.agent_id(), "H20");
  EXPECT_EQ(reply.model(), v1::GOALS);
  EXPECT_EQ(reply.observed_ns(), 104'800'000'000) << "poses are at even tenths";
  EXPECT_NEAR(reply.velocity().x(), 1.0, 1e-6);
  bool goes_up = false;
  bool goes_down = false;
  double sum = 0.0;
  double before = 1.0;
  for (const v1::PredictedPath& path : reply.paths()) {
    EXPECT_EQ(path.poses_size(), 25);
    for (const v1::PredictedPose& pose : path.poses()) EXPECT_TRUE(IsInT(pose.position()));
    goes_up = goes_up || path.poses().rbegin()->position().y() > 3.0;
    goes_down = goes_down || path.poses().rbegin()->position().y() < -3.0;
    EXPECT_LE(path.probability(), before);
    EXPECT_FALSE(path.goal_node_id().empty());
    before = path.probability();
    sum += path.probability();
  }
  EXPECT_TRUE(goes_up);
  EXPECT_TRUE(goes_down);
  EXPECT_LE(reply.paths_size(), 6);
  EXPECT_LE(sum, 1.0 + 1e-9);
  EXPECT_GT(sum, 0.8);
}

TEST_F(Predict, WalksOverNoLinkThatIsNoLongerThere) {
  v1::PredictAgentRequest request = AskFrom("walker", 105.1);
  request.set_horizon_ns(10 * kSecond);
  const v1::PredictAgentResponse reply = MustGet(request);
  EXPECT_GT(reply.paths_size(), 0);
  for (const v1::PredictedPath& path : reply.paths()) {
    for (const v1::PredictedPose& pose : path.poses()) EXPECT_GT(pose.position().y(), -kClearanceM);
  }
}

TEST_F(Predict, LooksAtNothingLater) {
  const v1::PredictAgentRequest request = AskFrom("walker", 106.0);
  const v1::PredictAgentResponse before = MustGet(request);
  EXPECT_EQ(before.SerializeAsString(), MustGet(request).SerializeAsString());
  core_.reset();
  GraphDelta later;
  later.author = "test";
  TrajectoryAppend back = Walk(NodeId('H', 20), 1062, 1080);
  for (TimedPose& pose : back.poses) pose.map_T_agent.position.x() = 106.0;
  later.appends = {back};
  CommitToOffice(folder_.path(), later);
  const v1::PredictAgentResponse after = MustGet(request);
  ASSERT_EQ(after.paths_size(), before.paths_size());
  for (int i = 0; i < after.paths_size(); ++i) {
    EXPECT_EQ(after.paths(i).SerializeAsString(), before.paths(i).SerializeAsString());
  }
  EXPECT_EQ(MustGet(Ask("walker")).observed_ns(), 108 * kSecond);
}

TEST_F(Predict, ForgetsHowSomebodyWentBeforeAGap) {
  v1::PredictAgentRequest request = AskFrom("12", 60.0);
  request.set_model(v1::CONSTANT_VELOCITY);
  const v1::PredictAgentResponse reply = MustGet(request);
  EXPECT_EQ(reply.velocity().x(), 0.0);
  EXPECT_EQ(reply.paths(0).poses().rbegin()->position().x(), 19.0);
  request.set_from_ns(40 * kSecond);
  EXPECT_EQ(MustGet(request).observed_ns(), 18 * kSecond) << "the last pose before the gap";
}

TEST_F(Predict, StopsStraightWalksAtWallsWhenAsked) {
  for (const auto model : {v1::CONSTANT_VELOCITY, v1::WEIGHTED_VELOCITY}) {
    v1::PredictAgentRequest request = AskFrom("walker", 106.0);
    request.set_model(model);
    request.set_horizon_ns(12 * kSecond);
    const v1::PredictAgentResponse through = MustGet(request);
    ASSERT_EQ(through.paths_size(), 1);
    EXPECT_EQ(through.model(), model);
    EXPECT_EQ(through.paths(0).goal_node_id(), "");
    EXPECT_GT(through.paths(0).poses().rbegin()->position().x(), 113.0);
    request.set_stop_at_walls(true);
    const v1::PredictAgentResponse stopped = MustGet(request);
    for (const v1::PredictedPose& pose : stopped.paths(0).poses()) {
      EXPECT_TRUE(IsInT(pose.position()));
    }
    EXPECT_GT(stopped.paths(0).poses().rbegin()->position().x(), 110.0);
  }
}

TEST_F(Predict, FallsBackWhereThereAreNoPlaces) {
  const v1::PredictAgentResponse reply = MustGet(Ask("H21"));
  EXPECT_EQ(reply.model(), v1::WEIGHTED_VELOCITY);
  ASSERT_EQ(reply.paths_size(), 1);
  ASSERT_EQ(reply.paths(0).poses_size(), 12);
  EXPECT_EQ(reply.paths(0).poses(0).time_ns(), 106'400'000'000);
  EXPECT_NEAR(reply.paths(0).poses(0).position().x(), 106.4, 0.02);
  ASSERT_EQ(reply.paths(0).poses(0).covariance_size(), 6);
  EXPECT_NEAR(reply.paths(0).poses(11).covariance(0), 1.44, 1e-9) << "(0.25 m/s * 4.8 s) squared";
}

TEST_F(Predict, HonoursRevisions) {
  v1::PredictAgentRequest request = Ask("walker");
  request.mutable_read_at()->set_exact_revision(1);
  ExpectRefused(request, Reason::kAgentUnknown, "");
}

TEST_F(Predict, RefusesWhatItCannotAnswer) {
  ExpectRefused(Ask("nobody"), Reason::kAgentUnknown, "");
  ExpectRefused(AskFrom("walker", 99.9), Reason::kTimeOutsideTrack, "");
  ExpectRefused(AskFrom("walker", 2e5), Reason::kTimeOutsideTrack, "");
  v1::PredictAgentRequest end = Ask("walker");
  end.set_from_ns(kTimeMax);
  ExpectRefused(end, Reason::kTimeOutsideTrack, "");
  const auto refuse = [&](const char* field, auto change) {
    v1::PredictAgentRequest request = Ask("walker");
    change(&request);
    ExpectRefused(request, Reason::kFieldInvalid, field);
  };
  refuse("horizon_ns", [](auto* request) { request->set_horizon_ns(-1); });
  refuse("horizon_ns", [](auto* request) { request->set_horizon_ns(kTimeMax); });
  refuse("period_ns", [](auto* request) { request->set_period_ns(-5); });
  refuse("period_ns", [](auto* request) { request->set_period_ns(1'000'000); });
  refuse("period_ns", [](auto* request) { request->set_period_ns(5 * kSecond); });
  refuse("path_count_max", [](auto* request) { request->set_path_count_max(21); });
  refuse("path_count_max", [](auto* request) { request->set_path_count_max(-1); });
  refuse("model", [](auto* request) { request->set_model(static_cast<v1::PredictionModel>(9)); });
}

TEST_F(Predict, GivesAsManyPathsAsAsked) {
  v1::PredictAgentRequest request = AskFrom("walker", 104.9);
  request.set_path_count_max(1);
  request.set_horizon_ns(10 * kSecond);
  EXPECT_EQ(MustGet(request).paths_size(), 1);
}

}  // namespace
}  // namespace dsg::test
