// SPDX-License-Identifier: Apache-2.0
// Walkers keep clear of walls and furniture and move like people.
#include "ingest/simulator/world/walker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "ingest/simulator/world/tour.h"
#include "ingest/simulator/world/world_graph.h"

namespace dsg::simulator {
namespace {

struct Stage {
  explicit Stage(uint64_t seed, WorldKind kind = WorldKind::kWing)
      : world(*GenerateWorld({kind, seed})), planner(&world) {}
  World world;
  Planner planner;
};

TEST(Crowd, HasUniqueSortedNamesAndOneRobot) {
  const std::vector<AgentSpec> crowd = MakeCrowd(40);
  ASSERT_EQ(crowd.size(), 41u);
  std::set<int> indices;
  int robot_count = 0;
  for (size_t i = 0; i < crowd.size(); ++i) {
    if (i > 0) {
      EXPECT_LT(crowd[i - 1].name, crowd[i].name);
    }
    indices.insert(crowd[i].index);
    if (crowd[i].is_robot) ++robot_count;
  }
  EXPECT_EQ(indices.size(), crowd.size());
  EXPECT_EQ(robot_count, 1);
  EXPECT_EQ(crowd.front().name, "alice");
  std::set<std::string> names;
  for (const AgentSpec& agent : crowd) names.insert(agent.name);
  EXPECT_TRUE(names.count("person-27"));
  EXPECT_TRUE(names.count("robot"));
}

// Judged by the boxes of the scene graph, not by the generator's own free space.
TEST(Walker, NeverComesNearAWallOrFurniture) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment}) {
    const uint64_t seed = 21;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage(seed, kind);
    std::vector<Box3d> solid;
    for (const Node& node : WorldGraph(stage.world).nodes) {
      const bool stands = node.kind == kinds::kStructure &&
                          node.structure->structure_type != "floor" &&
                          node.structure->structure_type != "ceiling";
      // Lintels and cups are above the feet; what stands on the floor counts.
      const bool is_low = node.BoxMap().min().z() < 0.01;
      if (is_low && (stands || node.kind == kinds::kObject)) solid.push_back(node.BoxMap());
    }
    for (const AgentSpec& agent : MakeCrowd(6)) {
      Walker walker(&stage.world, &stage.planner, agent, seed);
      for (TimeNs t = 0; t < 900 * kNsPerSecond; t += kNsPerSecond / 10) {
        const Point at = walker.PoseAt(t).position;
        const Eigen::Vector3d foot(at.x(), at.y(), 0.0);
        for (const Box3d& box : solid) {
          ASSERT_GE(DistanceToBox(foot, box), kPathClearanceM - 1e-6)
              << agent.name << " at " << t << " ns";
        }
      }
    }
  }
}

TEST(Walker, MovesAndTurnsSmoothly) {
  const Stage stage(22);
  constexpr double kStepS = 0.02;
  for (const AgentSpec& agent : MakeCrowd(4)) {
    Walker walker(&stage.world, &stage.planner, agent, 22);
    FloorPose last = walker.PoseAt(0);
    double top_speed = 0.0;
    for (int i = 1; i < 20'000; ++i) {
      const FloorPose pose = walker.PoseAt(static_cast<TimeNs>(i * kStepS * 1e9));
      const double speed = (pose.position - last.position).norm() / kStepS;
      const double turn =
          std::abs(std::remainder(pose.yaw - last.yaw, 2.0 * std::numbers::pi)) / kStepS;
      top_speed = std::max(top_speed, speed);
      ASSERT_LE(speed, 1.5 + 1e-6) << agent.name << " step " << i;
      ASSERT_LE(turn, 12.0) << agent.name << " step " << i;
      ASSERT_LE(std::abs(pose.yaw), std::numbers::pi + 1e-12);
      last = pose;
    }
    EXPECT_GE(top_speed, 0.8) << agent.name;
  }
}

TEST(Walker, LooksWhereItGoes) {
  const Stage stage(23);
  Walker walker(&stage.world, &stage.planner, MakeCrowd(1).front(), 23);
  int ahead = 0;
  int moving = 0;
  FloorPose last = walker.PoseAt(0);
  for (int i = 1; i < 6000; ++i) {
    const FloorPose pose = walker.PoseAt(i * kNsPerSecond / 10);
    const Point step = pose.position - last.position;
    if (step.norm() > 0.03) {
      ++moving;
      const double cosine = step.normalized().dot(Point(std::cos(pose.yaw), std::sin(pose.yaw)));
      if (cosine > 0.9) ++ahead;
    }
    last = pose;
  }
  EXPECT_GT(moving, 500);
  EXPECT_GT(ahead, 0.97 * moving);
}

TEST(Walker, DoesNotDependOnWhoElseWalks) {
  const Stage stage(24);
  const auto track = [&](int people_count) {
    for (const AgentSpec& agent : MakeCrowd(people_count)) {
      if (agent.name != "bob") continue;
      Walker walker(&stage.world, &stage.planner, agent, 24);
      return walker.PoseAt(500 * kNsPerSecond).position;
    }
    return Point(0, 0);
  };
  EXPECT_EQ(track(2), track(200));
}

TEST(Walker, RobotToursAllRoomsThatAreNoPassages) {
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing}) {
    const Stage stage(25, kind);
    const std::vector<int> rooms = RoomsToStay(stage.world);
    const AgentSpec robot = MakeCrowd(0).front();
    ASSERT_TRUE(robot.is_robot);
    Walker walker(&stage.world, &stage.planner, robot, 25);
    std::set<int> visited;
    for (size_t i = 0; i < rooms.size(); ++i) {
      visited.insert(stage.world.plan.RoomAt(walker.leg().goal.position));
      walker.NextLeg();
    }
    EXPECT_EQ(visited, std::set<int>(rooms.begin(), rooms.end()));
  }
}

}  // namespace
}  // namespace dsg::simulator
