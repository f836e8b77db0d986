// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "ingest/agents/contacts/contacts.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/agents/contacts/contact_paths.h"

namespace dsg::ingest {
namespace {

constexpr NodeId kCup('O', 7);

ThingBox Thing(NodeId object, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  ThingBox thing;
  thing.object = object;
  thing.box_map = Box3d(low, high);
  thing.from_ns = kTimeMin;
  thing.to_ns = kTimeMax;
  return thing;
}

AgentPath LeftHand(NodeId agent, std::vector<TimedPoint> hand) {
  AgentPath path;
  path.agent = agent;
  path.left_hand = std::move(hand);
  return path;
}

ThingBox UnitCup() { return Thing(kCup, {0, 0, 0}, {1, 1, 1}); }

TEST(Reaches, PastACornerEndWhereItsSphereDoes) {
  // Past the corner (1, 1, 1) at 0.3 m, along z, 1 m/s.
  const AgentPath path = LeftHand(kAda, {At(0, 1.3, 1, 0.5), At(2, 1.3, 1, 2.5)});
  const std::vector<Contact> contacts = FindReaches({path}, {UnitCup()}, {.reach_m = 0.5});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].agent, kAda);
  EXPECT_EQ(contacts[0].other, kCup);
  EXPECT_EQ(contacts[0].from_ns, 0);
  // Level with the cup until 0.5 s, then away from its corner for 0.4 m.
  EXPECT_EQ(contacts[0].to_ns, std::llround(0.9e9));
  EXPECT_NEAR(contacts[0].distance_m, 0.3, 1e-12);
  EXPECT_EQ(contacts[0].closest_ns, 0);
  EXPECT_TRUE(contacts[0].is_left_hand);
  EXPECT_EQ(contacts[0].hand_map, Eigen::Vector3d(1.3, 1, 0.5));
}

TEST(Reaches, ThroughAThingAreClosestWhenTheHandEnters) {
  const AgentPath path =
      LeftHand(kAda, {At(0, -2, 0.5, 0.5), At(2, 2, 0.5, 0.5), At(4, 6, 0.5, 0.5)});
  const std::vector<Contact> contacts = FindReaches({path}, {UnitCup()}, {.reach_m = 0.5});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, std::llround(0.75e9));
  EXPECT_EQ(contacts[0].to_ns, std::llround(1.75e9));
  EXPECT_EQ(contacts[0].closest_ns, kSecond);
  EXPECT_EQ(contacts[0].distance_m, 0.0);
  EXPECT_NEAR(contacts[0].hand_map.x(), 0.0, 1e-12);
}

TEST(Reaches, ThatJustTouchLastAnInstant) {
  const AgentPath path = LeftHand(kAda, {At(0, -1, 2.5, 2.5), At(1, 2, -0.5, 2.5)});
  // Closest to the top at (0.5, 1, 2.5), which is 1.5 m above it.
  EXPECT_TRUE(FindReaches({path}, {UnitCup()}, {.reach_m = 1.49}).empty());
  const AgentPath turning = LeftHand(kAda, {At(0, 2.5, 0, 0), At(1, 1.5, 0, 0), At(2, 2.5, 0, 0)});
  const std::vector<Contact> contacts = FindReaches({turning}, {UnitCup()}, {.reach_m = 0.5});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, kSecond);
  EXPECT_EQ(contacts[0].to_ns, kSecond);
  EXPECT_EQ(contacts[0].distance_m, 0.5);
}

TEST(Reaches, OfBothHandsAreOneAndNameTheCloser) {
  AgentPath path = LeftHand(kAda, {At(0, 1.4, 0, 0), At(1, 1.4, 0, 0)});
  path.right_hand = {At(0.5, 1.2, 0, 0), At(3, 1.2, 0, 0)};
  ContactOptions options;
  options.gap_ns_max = 5 * kSecond;
  const std::vector<Contact> contacts = FindReaches({path}, {UnitCup()}, options);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, 0);
  EXPECT_EQ(contacts[0].to_ns, 3 * kSecond);
  EXPECT_FALSE(contacts[0].is_left_hand);
  EXPECT_EQ(contacts[0].closest_ns, kSecond / 2);
  EXPECT_EQ(contacts[0].hand_map, Eigen::Vector3d(1.2, 0, 0));
}

TEST(Reaches, LastOnlyWhileTheThingIsThere) {
  const AgentPath path = LeftHand(kAda, {At(0, 1.2, 0, 0), At(1.5, 1.2, 0, 0), At(3, 1.2, 0, 0)});
  ThingBox thing = UnitCup();
  thing.from_ns = kSecond;
  thing.to_ns = 2 * kSecond;
  const std::vector<Contact> contacts = FindReaches({path}, {thing}, {});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, kSecond);
  EXPECT_EQ(contacts[0].to_ns, 2 * kSecond);
  thing.from_ns = 3 * kSecond + 1;
  EXPECT_TRUE(FindReaches({path}, {thing}, {}).empty());
}

TEST(Reaches, OfAThingThatMovedAreOneWhenNothingIsBetween) {
  const AgentPath path = LeftHand(kAda, {At(0, 0, 0, 0), At(2, 0, 0, 0), At(4, 0, 0, 0)});
  ThingBox before = Thing(kCup, {0.2, 0, 0}, {0.3, 1, 1});
  before.to_ns = 2 * kSecond;
  ThingBox after = Thing(kCup, {0.1, 0, 0}, {0.2, 1, 1});
  after.from_ns = 2 * kSecond;
  const std::vector<Contact> contacts = FindReaches({path}, {after, before}, {});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].to_ns, 4 * kSecond);
  EXPECT_EQ(contacts[0].closest_ns, 2 * kSecond);
  EXPECT_EQ(contacts[0].distance_m, 0.1);
}

TEST(Reaches, LeaveOutBoxesThatAreNone) {
  const AgentPath path = LeftHand(kAda, {At(0, 0, 0, 0), At(1, 0, 0, 0)});
  ThingBox empty = UnitCup();
  empty.box_map = Box3d();
  ThingBox endless = UnitCup();
  endless.box_map.max().x() = std::numeric_limits<double>::infinity();
  ThingBox no_number = UnitCup();
  no_number.box_map.min().y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(FindReaches({path}, {empty, endless, no_number}, {}).empty());
  EXPECT_EQ(FindReaches({path}, {empty, UnitCup()}, {}).size(), 1u);
}

TEST(Reaches, AreThoseThatSamplingFinds) {
  const uint64_t seed = test::TestSeed(57);
  ContactOptions options;
  size_t sample_count = 0;
  for (uint64_t i = 0; i < 30; ++i) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << " stream " << i);
    Random random(seed, i);
    const AgentPath path = LeftHand(kAda, RandomWalk(&random, 60, 4.0));
    const ThingBox thing = Thing(kCup, {1, 1, 0}, {1 + random.Uniform(0, 2), 2, 2});
    options.pause_ns = random.Chance(0.5) ? 0 : kSecond;
    const std::vector<Contact> contacts = FindReaches({path}, {thing}, options);
    for (TimeNs time_ns = 0; time_ns < path.left_hand.back().time_ns; time_ns += 5'000'000) {
      const auto hand_map = PositionAt(path.left_hand, time_ns, options.gap_ns_max);
      const auto contact = std::find_if(contacts.begin(), contacts.end(), [&](const Contact& c) {
        return c.from_ns <= time_ns && time_ns <= c.to_ns;
      });
      const double distance_m =
          hand_map.has_value() ? DistanceToBox(*hand_map, thing.box_map) : INFINITY;
      if (distance_m < options.reach_m - 1e-7) {
        ASSERT_NE(contact, contacts.end()) << "at " << time_ns;
        EXPECT_LE(contact->distance_m, distance_m + 1e-7);
        ++sample_count;
      }
      if (distance_m > options.reach_m + 1e-7 && options.pause_ns == 0) {
        ASSERT_EQ(contact, contacts.end()) << "at " << time_ns;
      }
    }
  }
  EXPECT_GT(sample_count, 1000u);
}

TEST(Reaches, DoNotDependOnTheOrderOfThings) {
  const uint64_t seed = test::TestSeed(58);
  Random random(seed, 0);
  std::vector<AgentPath> paths;
  for (uint64_t i = 0; i < 4; ++i) {
    paths.push_back(LeftHand(NodeId('h', i), RandomWalk(&random, 200, 6.0)));
    paths.back().right_hand = RandomWalk(&random, 200, 6.0);
  }
  std::vector<ThingBox> things;
  for (uint64_t i = 0; i < 20; ++i) {
    const Eigen::Vector3d low(random.Uniform(0, 6), random.Uniform(0, 6), random.Uniform(0, 2));
    things.push_back(Thing(NodeId('O', i % 15), low, low + Eigen::Vector3d(0.2, 0.3, 0.1)));
  }
  const std::vector<Contact> contacts = FindReaches(paths, things, {});
  EXPECT_GT(contacts.size(), 50u);
  std::reverse(paths.begin(), paths.end());
  std::reverse(things.begin(), things.end());
  EXPECT_TRUE(AreSame(contacts, FindReaches(paths, things, {}))) << "seed " << seed;
}

TEST(Reaches, OfSixtyPeopleAreFoundAmongAThousandThings) {
  const uint64_t seed = test::TestSeed(59);
  Random random(seed, 0);
  std::vector<AgentPath> paths;
  for (uint64_t i = 0; i < 60; ++i) {
    paths.push_back(LeftHand(NodeId('h', i), RandomWalk(&random, 5000, 40.0)));
    paths.back().right_hand = RandomWalk(&random, 5000, 40.0);
  }
  std::vector<ThingBox> things;
  for (uint64_t i = 0; i < 1000; ++i) {
    const Eigen::Vector3d low(random.Uniform(0, 40), random.Uniform(0, 40), random.Uniform(0, 2));
    things.push_back(Thing(NodeId('O', i), low, low + Eigen::Vector3d(0.5, 0.5, 0.5)));
  }
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Contact> contacts = FindReaches(paths, things, {});
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  std::printf("60 people x 2 hands x 5000 poses x 1000 things: %zu reaches, %.2f s\n",
              contacts.size(), taken.count());
  EXPECT_GT(contacts.size(), 1000u);
}

}  // namespace
}  // namespace dsg::ingest
