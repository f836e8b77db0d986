// SPDX-License-Identifier: Apache-2.0
// People in the way: where they were, where they are, where they are foreseen to be.
#include "query/engine/collision/obstacles.h"

#include <gtest/gtest.h>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using test::Ask;
using test::Scene;
using test::SphereAt;

constexpr TimeNs kSecond = kNsPerSecond;

// H1 walks along x with 1 m/s for ten seconds; H2 stood far off and was last seen at 3 s.
GraphDelta Walkers() {
  GraphDelta delta;
  delta.nodes = {test::AgentNode(1), test::AgentNode(2)};
  TrajectoryAppend walk{NodeId('H', 1), {}};
  for (int t = 0; t <= 10; ++t) walk.poses.push_back(test::StandingAt(t * kSecond, t, 0, 1));
  TrajectoryAppend stand{NodeId('H', 2), {}};
  for (int t = 0; t <= 3; ++t) stand.poses.push_back(test::StandingAt(t * kSecond, 0, 20, 1));
  delta.appends = {walk, stand};
  return delta;
}

TEST(AgentObstacles, StandWhereTheyWereAtTheInstant) {
  Scene scene;
  const Revision revision = scene.Commit(Walkers());
  const Body body = SphereAt(0.2, {4.5, 1, 1});
  const CollisionHit hit = Ask(scene.World(revision, 4'500'000'000), body, {});
  EXPECT_EQ(hit.kind, ObstacleKind::kAgent);
  EXPECT_EQ(hit.node, NodeId('H', 1));
  EXPECT_NEAR(hit.clearance_m, 1.0 - 0.3 - 0.2, 1e-9);
  EXPECT_NEAR(hit.point_map.y(), 0.3, 1e-9);
  EXPECT_EQ(Ask(scene.World(revision, 8 * kSecond), body, {}).kind, ObstacleKind::kNone);
  // 1.7 m high around the torso.
  const double top_m = 1.0 + 0.85;
  EXPECT_TRUE(Ask(scene.World(revision, 4 * kSecond), SphereAt(0.2, {4, 0, top_m + 0.19}), {}).hit);
  EXPECT_FALSE(
      Ask(scene.World(revision, 4 * kSecond), SphereAt(0.2, {4, 0, top_m + 0.21}), {}).hit);
}

TEST(AgentObstacles, NowMeansTheLastPosesOfThoseSeenLately) {
  Scene scene;
  const Revision revision = scene.Commit(Walkers());
  EXPECT_EQ(Ask(scene.World(revision), SphereAt(0.2, {10, 0, 1}), {}).node, NodeId('H', 1));
  EXPECT_FALSE(Ask(scene.World(revision), SphereAt(0.2, {0, 20, 1}), {}).hit);
  EXPECT_TRUE(Ask(scene.World(revision, 3 * kSecond), SphereAt(0.2, {0, 20, 1}), {}).hit);
}

TEST(AgentObstacles, AreForeseenAfterTheirTracksWithGrowingDoubt) {
  Scene scene;
  const Revision revision = scene.Commit(Walkers());
  CollisionScope scope;
  scope.predicted_agents = true;
  const Body body = SphereAt(0.1, {12, 1.5, 1});
  CollisionHit hit = Ask(scene.World(revision, 12 * kSecond), body, scope);
  EXPECT_EQ(hit.kind, ObstacleKind::kPredictedAgent);
  EXPECT_EQ(hit.node, NodeId('H', 1));
  EXPECT_LT(hit.clearance_m, 1.5 - 0.1 - 0.3);
  EXPECT_EQ(hit.observed, false);
  scope.predicted_agents = false;
  EXPECT_EQ(Ask(scene.World(revision, 12 * kSecond), body, scope).kind, ObstacleKind::kNone);
  scope.predicted_agents = true;
  EXPECT_EQ(Ask(scene.World(revision, 30 * kSecond), SphereAt(0.1, {30, 0, 1}), scope).kind,
            ObstacleKind::kNone);
  EXPECT_EQ(Ask(scene.World(revision, kTimeMax - 1), SphereAt(0.1, {30, 0, 1}), scope).kind,
            ObstacleKind::kNone);
}

TEST(AgentObstacles, AreForeseenByMoreThanTheirLastStep) {
  Scene scene;
  GraphDelta delta;
  delta.nodes = {test::AgentNode(1)};
  TrajectoryAppend walk{NodeId('H', 1), {}};
  // 1 m/s at 10 Hz; 5 cm of noise make the last step stand still.
  for (int i = 0; i <= 100; ++i) {
    const double noise_m = i % 2 == 0 ? -0.05 : 0.05;
    walk.poses.push_back(test::StandingAt(i * kSecond / 10, 0.1 * i + noise_m, 0, 1));
  }
  delta.appends = {walk};
  const Revision revision = scene.Commit(delta);
  CollisionScope scope;
  scope.predicted_agents = true;
  EXPECT_TRUE(Ask(scene.World(revision, 12 * kSecond), SphereAt(0.1, {13, 0, 1}), scope).hit);
  EXPECT_FALSE(Ask(scene.World(revision, 12 * kSecond), SphereAt(0.1, {9.5, 0, 1}), scope).hit);
}

TEST(AgentObstacles, KnowOnlyWhatTheRevisionKnew) {
  Scene scene;
  const Revision before = scene.Commit(Walkers());
  GraphDelta more;
  TrajectoryAppend walk{NodeId('H', 1), {}};
  for (int t = 11; t <= 12; ++t) walk.poses.push_back(test::StandingAt(t * kSecond, t, 0, 1));
  more.appends = {walk};
  const Revision after = scene.Commit(more);
  const Body body = SphereAt(0.1, {12, 0, 1});
  EXPECT_FALSE(Ask(scene.World(before, 12 * kSecond), body, {}).hit);
  EXPECT_TRUE(Ask(scene.World(after, 12 * kSecond), body, {}).hit);
  EXPECT_FALSE(Ask(scene.World(before), body, {}).hit);
  EXPECT_TRUE(Ask(scene.World(after), body, {}).hit);
}

TEST(AgentObstacles, TakeTheirBoxWhereTheyHaveOne) {
  Scene scene;
  GraphDelta delta = Walkers();
  delta.nodes[0].box_node =
      Box3d(Eigen::Vector3d(-0.1, -0.6, -0.2), Eigen::Vector3d(0.1, 0.6, 0.2));
  const Revision revision = scene.Commit(delta);
  const CollisionHit hit = Ask(scene.World(revision, 4 * kSecond), SphereAt(0.1, {4, 1, 1}), {});
  EXPECT_NEAR(hit.clearance_m, 0.3, 1e-9);
}

}  // namespace
}  // namespace dsg::query
