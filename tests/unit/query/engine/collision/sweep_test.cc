// SPDX-License-Identifier: Apache-2.0
// A body on its way: the same as standing at very many poses of it.
#include "query/engine/collision/sweep.h"

#include <gtest/gtest.h>

#include "tests/unit/query/engine/collision/scene.h"

namespace dsg::query {
namespace {

using Eigen::Vector3d;
using test::Ask;
using test::Scene;

GraphDelta SparseThings(Random* random) {
  GraphDelta delta;
  std::vector<Convex> triangles;
  for (uint64_t i = 1; i <= 14; ++i) {
    delta.nodes.push_back(
        test::ObjectAt(i, test::RandomPose(random, 3.0), test::RandomBox(random)));
    const Pose3d pose = test::RandomPose(random, 3.0);
    triangles.push_back(MakeTriangle(pose * Vector3d(0, 0, 0), pose * Vector3d(0.4, 0, 0),
                                     pose * Vector3d(0, 0.4, 0)));
  }
  delta.mesh_blocks = test::Blocks(triangles, {});
  return delta;
}

Body MovingBody(Random* random) {
  Body body;
  switch (random->Index(4)) {
    case 0:
      body.kind = Body::Kind::kSphere;
      body.radius_m = random->Uniform(0.01, 0.3);
      break;
    case 1:
      body.kind = Body::Kind::kCuboid;
      body.size = Vector3d(0.4, 0.2, 0.1);
      break;
    case 2:
      body.kind = Body::Kind::kCapsule;
      body.radius_m = 0.05;
      body.length_m = 0.6;
      break;
    default:
      body.kind = Body::Kind::kMesh;
      body.mesh = std::make_shared<const TriangleTree>(
          std::vector<Eigen::Vector3f>{{0, 0, 0}, {0.4f, 0, 0}, {0, 0.3f, 0}, {0, 0, 0.2f}},
          std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 1, 3}, {1, 2, 3}});
  }
  body.poses = {test::RandomPose(random, 3.0), test::RandomPose(random, 3.0),
                test::RandomPose(random, 3.0)};
  return body;
}

TEST(Sweep, EqualsStandingAtManyPosesOfTheWay) {
  Random random(test::TestSeed(8), 0);
  int hit_count = 0;
  constexpr int kBodyCount = 60;
  constexpr int kStepCount = 300;
  for (int i = 0; i < kBodyCount; ++i) {
    SCOPED_TRACE(i);
    static Scene* scene = nullptr;
    static Revision revision = 0;
    if (i % 20 == 0) {
      delete scene;
      scene = new Scene();
      revision = scene->Commit(SparseThings(&random));
    }
    const Body body = MovingBody(&random);
    CollisionScope scope;
    scope.agents = false;
    const CollisionHit swept = Ask(scene->World(revision), body, scope);
    hit_count += swept.hit ? 1 : 0;
    double nearest_m = scope.clearance_m_max;
    double first_hit = std::numeric_limits<double>::infinity();
    double step_m = 0.0;
    for (int step = 0; step <= 2 * kStepCount; ++step) {
      const int leg = std::min(step / kStepCount, 1);
      const double fraction = static_cast<double>(step - leg * kStepCount) / kStepCount;
      const Pose3d& from = body.poses[static_cast<size_t>(leg)];
      const Pose3d& to = body.poses[static_cast<size_t>(leg) + 1];
      step_m = std::max(step_m, TravelM(body, from, to) / kStepCount);
      Body still = body;
      still.poses = {Interpolate(from, to, fraction)};
      const CollisionHit hit = Ask(scene->World(revision), still, scope);
      nearest_m = std::min(nearest_m, hit.clearance_m);
      if (hit.hit) first_hit = std::min(first_hit, leg + fraction);
    }
    if (first_hit < 1e9) {
      EXPECT_TRUE(swept.hit);
      EXPECT_LE(swept.at_pose, first_hit + 1e-9);
    } else if (swept.hit) {
      // Between two of the poses.
      EXPECT_LT(nearest_m, step_m);
    } else {
      const double error_m =
          body.kind == Body::Kind::kSphere ? 1e-9 : std::max(0.005, 0.05 * nearest_m);
      EXPECT_LE(swept.clearance_m, nearest_m + error_m);
      EXPECT_GE(swept.clearance_m, nearest_m - step_m);
    }
    // At the pose that is named it is so.
    Body there = body;
    const int leg = std::min(static_cast<int>(swept.at_pose), 1);
    there.poses = {Interpolate(body.poses[static_cast<size_t>(leg)],
                               body.poses[static_cast<size_t>(leg) + 1], swept.at_pose - leg)};
    if (swept.kind != ObstacleKind::kNone) {
      EXPECT_NEAR(Ask(scene->World(revision), there, scope).clearance_m, swept.clearance_m, 1e-6);
    }
  }
  EXPECT_GT(hit_count, 10);
  EXPECT_LT(hit_count, 55);
}

TEST(Sweep, ASphereMeetsAWallWhereItsSurfaceDoes) {
  Scene scene;
  GraphDelta delta;
  delta.mesh_blocks = test::Blocks(test::Rectangle({5, -1, -1}, {0, 2, 0}, {0, 0, 2}), {});
  const Revision revision = scene.Commit(delta);
  const Body body = SweptSphere(0.25, {{0, 0, 0}, {4, 0, 0}, {8, 0, 0}});
  CollisionHit hit = Ask(scene.World(revision), body, {});
  EXPECT_TRUE(hit.hit);
  EXPECT_NEAR(hit.at_pose, 1.0 + 0.75 / 4.0, 1e-9);
  EXPECT_LT((hit.point_map - Vector3d(5, 0, 0)).norm(), 1e-6);
  CollisionScope scope;
  scope.margin_m = 0.5;
  hit = Ask(scene.World(revision), body, scope);
  EXPECT_NEAR(hit.at_pose, 1.0 + 0.25 / 4.0, 1e-9);
  EXPECT_NEAR(hit.clearance_m, 0.5, 1e-9);
}

TEST(Sweep, ATurningBeamHitsWhatItsEndsPass) {
  Scene scene;
  GraphDelta delta;
  const Vector3d half = Vector3d::Constant(0.05);
  delta.nodes = {
      test::ObjectAt(1, {{0, 0.9, 0}, Eigen::Quaterniond::Identity()}, Box3d(-half, half))};
  const Revision revision = scene.Commit(delta);
  Body beam;
  beam.kind = Body::Kind::kCuboid;
  beam.size = Vector3d(2, 0.02, 0.02);
  const auto yaw = [](double angle) {
    return Pose3d{Vector3d::Zero(),
                  Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()))};
  };
  beam.poses = {yaw(0.0), yaw(3.0)};
  const CollisionHit hit = Ask(scene.World(revision), beam, {});
  EXPECT_TRUE(hit.hit);
  // Before the middle of the beam points at the object.
  EXPECT_LT(hit.at_pose * 3.0, std::numbers::pi / 2);
  EXPECT_GT(hit.at_pose * 3.0, std::numbers::pi / 2 - 0.2);
}

}  // namespace
}  // namespace dsg::query
