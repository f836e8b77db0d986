// SPDX-License-Identifier: Apache-2.0
// People walk, stop, take things and put them down, and nothing of it jumps.
#include "ingest/simulator/body/human_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "ingest/simulator/body/errand_board.h"

namespace dsg::simulator {
namespace {

TimeNs At(double seconds) { return static_cast<TimeNs>(seconds * 1e9); }

/// A world with people in it.
struct Stage {
  Stage(WorldKind kind, int people, double seconds, uint64_t seed)
      : duration_s(seconds),
        world(*GenerateWorld({kind, seed})),
        crowd(CrowdMotion::Make(&world, {people, seconds, 20, nullptr}, seed)) {}
  double duration_s;
  World world;
  std::unique_ptr<CrowdMotion> crowd;
};

Stage Apartment(uint64_t seed) { return Stage(WorldKind::kApartment, 3, 25.0, seed); }
Stage Office(uint64_t seed) { return Stage(WorldKind::kOffice, 6, 300.0, seed); }

// The surface that an object stands on: its top is at the object's bottom.
bool RestsOnSomething(const World& world, int object, const Pose3d& pose) {
  const double bottom = pose.position.z() - 0.5 * world.furniture[object].size.z();
  for (const Furniture& item : world.furniture) {
    if (item.on >= 0 || !item.Footprint().contains(Point(pose.position.head<2>()))) continue;
    if (std::abs(item.center.z() + 0.5 * item.size.z() - bottom) < 1e-6) return true;
  }
  return false;
}

TEST(CrowdMotion, JointsNeverJump) {
  for (const uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage = seed == 3 ? Office(seed) : Apartment(seed);
    constexpr double kStepS = 0.01;
    for (int person = 0; person < std::min(3, stage.crowd->count()); ++person) {
      BodyState last = stage.crowd->StateAt(person, 0);
      for (double t = kStepS; t <= stage.duration_s; t += kStepS) {
        const BodyState state = stage.crowd->StateAt(person, At(t));
        for (int j = 0; j < ingest::kJointCount; ++j) {
          const double moved_m = (state.joints_map[j] - last.joints_map[j]).norm();
          ASSERT_LT(moved_m, 8.0 * kStepS) << "person " << person << " joint " << j << " at " << t;
        }
        last = state;
      }
    }
  }
}

TEST(CrowdMotion, TorsosKeepClearOfObstaclesAndAbovePaths) {
  for (const uint64_t seed : {4, 5}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage = seed == 4 ? Apartment(seed) : Office(seed);
    for (int person = 0; person < stage.crowd->count(); ++person) {
      const BodyModel& body = stage.crowd->body(person);
      for (double t = 0.0; t <= stage.duration_s; t += 0.1) {
        const BodyState state = stage.crowd->StateAt(person, At(t));
        const Point floor = state.map_T_torso.position.head<2>();
        EXPECT_GE(stage.world.free_space.Clearance(floor), kPathClearanceM - 1e-6);
        EXPECT_DOUBLE_EQ(state.map_T_torso.position.z(), body.pelvis_height_m());
        const Eigen::Vector3d up = state.map_T_torso.orientation * Eigen::Vector3d::UnitZ();
        EXPECT_NEAR(up.z(), 1.0, 1e-9);
        EXPECT_LT((state.joints_map[0].head<2>() - floor).norm(), 0.15);
      }
    }
  }
}

TEST(CrowdMotion, FeetAreNearTheFloor) {
  const Stage stage = Apartment(6);
  for (int person = 0; person < 3; ++person) {
    for (double t = 0.0; t <= stage.duration_s; t += 0.05) {
      const BodyState state = stage.crowd->StateAt(person, At(t));
      const double low = std::min(state.joints_map[7].z(), state.joints_map[8].z());
      EXPECT_GT(low, 0.04);
      EXPECT_LT(low, 0.14);
    }
  }
}

TEST(CrowdMotion, PeopleWalkAndPause) {
  const Stage stage = Office(7);
  for (int person = 0; person < 6; ++person) {
    int standing = 0;
    int walking = 0;
    Point last = stage.crowd->StateAt(person, 0).map_T_torso.position.head<2>();
    for (double t = 0.5; t <= stage.duration_s; t += 0.5) {
      const Point at = stage.crowd->StateAt(person, At(t)).map_T_torso.position.head<2>();
      const double speed = (at - last).norm() / 0.5;
      EXPECT_LT(speed, 1.55);
      ++(speed < 0.01 ? standing : walking);
      last = at;
    }
    EXPECT_GT(standing, 30);
    EXPECT_GT(walking, 150);
  }
}

TEST(CrowdMotion, ObjectsAreInTheHandWhileCarriedAndOnASurfaceAfterwards) {
  int placed = 0;
  for (const uint64_t seed : {8, 9, 10, 11}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage = seed == 8 ? Office(seed) : Apartment(seed);
    for (const PickEvent& pick : stage.crowd->picks()) {
      const Furniture& item = stage.world.furniture[pick.object];
      SCOPED_TRACE(item.name);
      EXPECT_EQ(pick.room, item.room);
      EXPECT_TRUE(pick.hand_joint == ingest::kLeftHand || pick.hand_joint == ingest::kRightHand);
      const TimeNs end_ns = std::min(pick.place_ns, At(stage.duration_s));
      for (TimeNs t = pick.pick_ns; t <= end_ns; t += At(0.05)) {
        const Eigen::Vector3d hand =
            stage.crowd->StateAt(pick.person, t).joints_map[pick.hand_joint];
        ASSERT_LT((stage.crowd->ObjectPoseAt(pick.object, t).position - hand).norm(), 0.05);
      }
      const Pose3d before = stage.crowd->ObjectPoseAt(pick.object, pick.pick_ns - 1);
      EXPECT_EQ(before.position, item.center);
      if (pick.place_ns == kTimeMax) continue;
      ++placed;
      EXPECT_GT(pick.place_ns, pick.pick_ns);
      const Pose3d after = stage.crowd->ObjectPoseAt(pick.object, At(stage.duration_s));
      EXPECT_EQ(after.position, pick.map_T_object_after.position);
      EXPECT_TRUE(RestsOnSomething(stage.world, pick.object, after));
      EXPECT_TRUE(IsValidPose(after));
    }
  }
  EXPECT_GT(placed, 5);
}

TEST(CrowdMotion, CarriedObjectsNeverJump) {
  const Stage stage = Office(12);
  ASSERT_FALSE(stage.crowd->picks().empty());
  for (const PickEvent& pick : stage.crowd->picks()) {
    Pose3d last = stage.crowd->ObjectPoseAt(pick.object, pick.pick_ns - At(0.1));
    const TimeNs end_ns = std::min(pick.place_ns, At(stage.duration_s - 0.1)) + At(0.1);
    for (TimeNs t = pick.pick_ns - At(0.09); t < end_ns; t += At(0.01)) {
      const Pose3d pose = stage.crowd->ObjectPoseAt(pick.object, t);
      ASSERT_LT((pose.position - last.position).norm(), 0.06);
      ASSERT_LT(AngleBetween(pose.orientation, last.orientation), 0.1);
      last = pose;
    }
  }
}

TEST(CrowdMotion, PutDownObjectsDoNotTouchOthers) {
  const Stage stage = Office(13);
  for (const PickEvent& pick : stage.crowd->picks()) {
    if (pick.place_ns == kTimeMax) continue;
    const Eigen::Vector3d size = stage.world.furniture[pick.object].size;
    for (size_t i = 0; i < stage.world.furniture.size(); ++i) {
      const Furniture& other = stage.world.furniture[i];
      if (other.on < 0 || static_cast<int>(i) == pick.object) continue;
      const Pose3d pose = stage.crowd->ObjectPoseAt(static_cast<int>(i), At(stage.duration_s));
      const double apart = (pose.position - pick.map_T_object_after.position).head<2>().norm();
      if (std::abs(pose.position.z() - pick.map_T_object_after.position.z()) > 0.5) continue;
      EXPECT_GT(apart, 0.5 * (size.head<2>().norm() + other.size.head<2>().norm()));
    }
  }
}

TEST(CrowdMotion, LogsHaveAsManyPicksAsPromised) {
  int apartment_picks = 0;
  for (uint64_t seed = 20; seed < 30; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage = Apartment(seed);
    EXPECT_LE(stage.crowd->picks().size(), 3u);
    apartment_picks += static_cast<int>(stage.crowd->picks().size());
  }
  EXPECT_GE(apartment_picks, 14);
  for (uint64_t seed = 20; seed < 23; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Stage stage = Office(seed);
    const std::vector<PickEvent>& picks = stage.crowd->picks();
    EXPECT_GE(picks.size(), 10u);
    EXPECT_LE(picks.size(), 20u);
    EXPECT_EQ(stage.crowd->movable().size(), picks.size());
    EXPECT_TRUE(std::is_sorted(
        picks.begin(), picks.end(),
        [](const PickEvent& a, const PickEvent& b) { return a.pick_ns < b.pick_ns; }));
    const std::vector<int>& movable = stage.crowd->movable();
    EXPECT_TRUE(std::is_sorted(movable.begin(), movable.end()));
    EXPECT_EQ(std::set<int>(movable.begin(), movable.end()).size(), movable.size());
  }
}

TEST(CrowdMotion, PeopleRarelyRunIntoEachOther) {
  const Stage stage(WorldKind::kOffice, 24, 120.0, 14);
  int near = 0;
  int samples = 0;
  for (double t = 0.0; t <= stage.duration_s; t += 0.5) {
    std::vector<Point> points;
    for (int person = 0; person < 24; ++person) {
      const BodyState state = stage.crowd->StateAt(person, At(t));
      points.push_back(state.map_T_torso.position.head<2>());
    }
    for (size_t a = 0; a < points.size(); ++a) {
      ++samples;
      for (size_t b = 0; b < a; ++b) near += (points[a] - points[b]).norm() < 0.4 ? 1 : 0;
    }
  }
  EXPECT_LT(near, samples / 200);
}

TEST(CrowdMotion, PeopleMakeWayForTheRobot) {
  const World world = *GenerateWorld({WorldKind::kApartment, 19});
  const CrowdMotionOptions plain = {4, 200.0, 20, nullptr};
  const auto before = CrowdMotion::Make(&world, plain, 19);
  // A robot that stands where the first person likes to be.
  const Point at = before->StateAt(0, At(60.0)).map_T_torso.position.head<2>();
  CrowdMotionOptions with_robot = plain;
  with_robot.robot_at = [at](TimeNs) { return at; };
  const auto after = CrowdMotion::Make(&world, with_robot, 19);
  const auto near_count = [&](const CrowdMotion& crowd) {
    int count = 0;
    for (int person = 0; person < crowd.count(); ++person) {
      for (double t = 0.0; t < 200.0; t += 0.5) {
        const Point position = crowd.StateAt(person, At(t)).map_T_torso.position.head<2>();
        count += (position - at).norm() < 0.4 ? 1 : 0;
      }
    }
    return count;
  };
  EXPECT_GT(near_count(*before), 3);
  EXPECT_LT(near_count(*after), near_count(*before));
}

TEST(CrowdMotion, IsTheSameEachTime) {
  const Stage a = Apartment(15);
  const Stage b = Apartment(15);
  ASSERT_EQ(a.crowd->picks().size(), b.crowd->picks().size());
  // In another order of questions.
  for (int step = 50; step >= 0; --step) {
    for (int person = 0; person < 3; ++person) {
      const BodyState left = a.crowd->StateAt(person, At(0.5 * step));
      const BodyState right = b.crowd->StateAt(2 - person, At(0.5 * (50 - step)));
      const BodyState again = b.crowd->StateAt(person, At(0.5 * step));
      EXPECT_EQ(left.joints_map, again.joints_map);
      EXPECT_TRUE(right.joints_map[0].allFinite());
    }
  }
  const Stage other = Apartment(16);
  EXPECT_NE(a.crowd->body(0).shape(), other.crowd->body(0).shape());
}

TEST(CrowdMotion, WorksWithoutPeopleAndWithoutPicks) {
  const World world = *GenerateWorld({WorldKind::kApartment, 17});
  const auto nobody = CrowdMotion::Make(&world, {0, 25.0, 20, nullptr}, 17);
  EXPECT_EQ(nobody->count(), 0);
  EXPECT_TRUE(nobody->picks().empty());
  EXPECT_TRUE(nobody->movable().empty());
  for (size_t i = 0; i < world.furniture.size(); ++i) {
    EXPECT_EQ(nobody->ObjectPoseAt(static_cast<int>(i), At(3.0)).position,
              world.furniture[i].center);
  }
  const auto instant = CrowdMotion::Make(&world, {3, 1.0, 20, nullptr}, 17);
  EXPECT_TRUE(instant->picks().empty());
  EXPECT_TRUE(instant->StateAt(2, At(1.0)).joints_map[15].allFinite());
}

TEST(CrowdMotion, NamesDifferAndAreNotTheRobots) {
  const Stage stage(WorldKind::kOffice, 30, 5.0, 18);
  std::set<std::string> names;
  for (int person = 0; person < 30; ++person) names.insert(stage.crowd->name(person));
  EXPECT_EQ(names.size(), 30u);
  EXPECT_EQ(stage.crowd->name(0), "alice");
  EXPECT_FALSE(names.contains("robot"));
}

}  // namespace
}  // namespace dsg::simulator
