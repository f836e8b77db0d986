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

constexpr NodeId kBen('h', 2);

AgentPath Walker(NodeId agent, std::vector<TimedPoint> torso) {
  AgentPath path;
  path.agent = agent;
  path.torso = std::move(torso);
  return path;
}

TEST(Encounters, OfTwoWhoPassHeadOnEndWhereTheirDistanceDoes) {
  // 8 m apart, 2 m/s towards each other in lanes 1 m apart.
  const std::vector<Contact> contacts =
      FindEncounters({Walker(kAda, {At(0, 0, 0), At(2, 2, 0), At(4, 4, 0), At(6, 6, 0)}),
                      Walker(kBen, {At(0, 8, 1), At(1.5, 6.5, 1), At(3.5, 4.5, 1), At(5, 3, 1)})},
                     {.encounter_m = 2.0});
  ASSERT_EQ(contacts.size(), 1u);
  const double half_s = std::sqrt(3.0) / 2.0;
  EXPECT_EQ(contacts[0].agent, kAda);
  EXPECT_EQ(contacts[0].other, kBen);
  EXPECT_EQ(contacts[0].from_ns, std::llround((4.0 - half_s) * 1e9));
  EXPECT_EQ(contacts[0].to_ns, std::llround((4.0 + half_s) * 1e9));
  EXPECT_EQ(contacts[0].closest_ns, 4 * kSecond);
  EXPECT_NEAR(contacts[0].distance_m, 1.0, 1e-12);
}

TEST(Encounters, OfTwoWhoJustTouchLastAnInstant) {
  const AgentPath ada = Walker(kAda, {At(0, -3, 0), At(1, 3, 0)});
  const AgentPath ben = Walker(kBen, {At(0, 0, 2), At(1, 0, 2)});
  const std::vector<Contact> contacts = FindEncounters({ada, ben}, {.encounter_m = 2.0});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, kSecond / 2);
  EXPECT_EQ(contacts[0].to_ns, kSecond / 2);
  EXPECT_EQ(contacts[0].distance_m, 2.0);
  EXPECT_TRUE(FindEncounters({ada, ben}, {.encounter_m = 1.999}).empty());
}

TEST(Encounters, BeginWhereAWalkEndsAtTheLimit) {
  const std::vector<Contact> contacts =
      FindEncounters({Walker(kAda, {At(0, -5, 0), At(1, -2, 0), At(2, -2, 0), At(3, -5, 0)}),
                      Walker(kBen, {At(0, 0, 0), At(1.7, 0, 0), At(3, 0, 0)})},
                     {.encounter_m = 2.0});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, kSecond);
  EXPECT_EQ(contacts[0].to_ns, 2 * kSecond);
  EXPECT_EQ(contacts[0].closest_ns, kSecond);
}

TEST(Encounters, OfTwoWhoStandTogetherLastAsLongAsBothAreSeen) {
  const std::vector<Contact> contacts =
      FindEncounters({Walker(kBen, {At(1, 1, 0), At(2, 1, 0), At(3, 1, 0), At(4, 1, 0)}),
                      Walker(kAda, {At(0.5, 0, 0), At(2.25, 0, 0), At(3.5, 0, 0)})},
                     {});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].agent, kAda);
  EXPECT_EQ(contacts[0].from_ns, kSecond);
  EXPECT_EQ(contacts[0].to_ns, std::llround(3.5e9));
  EXPECT_EQ(contacts[0].closest_ns, kSecond);
  EXPECT_EQ(contacts[0].distance_m, 1.0);
}

TEST(Encounters, GoOnOverPausesShorterThanTheLimit) {
  const AgentPath still = Walker(kAda, {At(0, 0, 0), At(2, 0, 0), At(4, 0, 0), At(6, 0, 0)});
  // Farther than 2 m from 1.5 s to 2.5 s.
  const AgentPath turning = Walker(kBen, {At(0, 0.5, 0), At(2, 2.5, 0), At(4, 0.5, 0)});
  ContactOptions options;
  options.pause_ns = kSecond;
  EXPECT_EQ(FindEncounters({still, turning}, options).size(), 2u);
  options.pause_ns = kSecond + 1;
  const std::vector<Contact> merged = FindEncounters({still, turning}, options);
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_EQ(merged[0].from_ns, 0);
  EXPECT_EQ(merged[0].to_ns, 4 * kSecond);
  EXPECT_EQ(merged[0].closest_ns, 0);
  EXPECT_EQ(merged[0].distance_m, 0.5);
}

TEST(Encounters, DoNotBridgeGaps) {
  const AgentPath still = Walker(kAda, {At(0, 0, 0), At(1, 0, 0), At(4, 0, 0), At(5, 0, 0)});
  const AgentPath passing = Walker(kBen, {At(0, 9, 0), At(2, 1, 0), At(3, 1, 0), At(5, 9, 0)});
  // They are near each other from 1.75 s to 3.25 s, when one of them is not seen.
  EXPECT_TRUE(FindEncounters({still, passing}, {}).empty());
  ContactOptions options;
  options.gap_ns_max = 3 * kSecond;
  EXPECT_EQ(FindEncounters({still, passing}, options).size(), 1u);
}

TEST(Encounters, OfSomebodySeenOnceLastAnInstant) {
  const std::vector<Contact> contacts =
      FindEncounters({Walker(kAda, {At(0, 0, 0), At(2, 2, 0)}), Walker(kBen, {At(1, 1, 0.5)})}, {});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].from_ns, kSecond);
  EXPECT_EQ(contacts[0].to_ns, kSecond);
  EXPECT_DOUBLE_EQ(contacts[0].distance_m, 0.5);
}

TEST(Encounters, TakeTwoPathsOfOneAgentAsOne) {
  const AgentPath early = Walker(kAda, {At(0, 0, 0), At(1, 0, 0)});
  const AgentPath late = Walker(kAda, {At(1, 0.5, 0), At(2, 0.5, 0)});
  const AgentPath other = Walker(kBen, {At(0, 1, 0), At(2, 1, 0)});
  const std::vector<Contact> contacts = FindEncounters({early, late, other}, {});
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].to_ns, 2 * kSecond);
  EXPECT_EQ(contacts[0].closest_ns, kSecond);
}

TEST(Encounters, LeaveOutSamplesThatAreNoNumbersAndSortTheRest) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const AgentPath clean = Walker(kAda, {At(0, 0, 0), At(1, 1, 0), At(2, 2, 0)});
  const AgentPath dirty = Walker(kAda, {At(2, 2, 0), At(0, 0, 0), At(0.5, nan, 0), At(1, 1, 0),
                                        At(1.5, 1e300, 0), At(1, 9, 9), At(1.7, 0, INFINITY)});
  const AgentPath other = Walker(kBen, {At(0, 3, 0), At(2, 3, 0)});
  EXPECT_TRUE(AreSame(FindEncounters({clean, other}, {}), FindEncounters({dirty, other}, {})));
  EXPECT_EQ(FindEncounters({clean, other}, {}).size(), 1u);
  EXPECT_TRUE(FindEncounters({Walker(kAda, {At(0, nan, 0)}), other, Walker(kAda, {})}, {}).empty());
}

TEST(Encounters, BearTheEndsOfTheClock) {
  const std::vector<TimedPoint> ends = {{.time_ns = kTimeMin, .position_map = {0, 0, 0}},
                                        {.time_ns = -5, .position_map = {1, 0, 0}},
                                        {.time_ns = kTimeMax, .position_map = {0, 0, 0}}};
  ContactOptions options;
  options.pause_ns = kTimeMax;
  for (const TimeNs gap_ns_max : {kTimeMin, TimeNs{0}, kSecond, kTimeMax}) {
    options.gap_ns_max = gap_ns_max;
    const std::vector<Contact> contacts =
        FindEncounters({Walker(kAda, ends), Walker(kBen, ends)}, options);
    ASSERT_FALSE(contacts.empty());
    EXPECT_EQ(contacts.front().from_ns, kTimeMin);
    EXPECT_EQ(contacts.back().to_ns, kTimeMax);
  }
}

// Millisecond by millisecond.
std::vector<Span> SampleEncounters(const AgentPath& a, const AgentPath& b,
                                   const ContactOptions& options, TimeNs end_ns) {
  std::vector<Span> spans;
  bool is_open = false;
  for (TimeNs time_ns = 0; time_ns <= end_ns; time_ns += 1'000'000) {
    const auto at_a = PositionAt(a.torso, time_ns, options.gap_ns_max);
    const auto at_b = PositionAt(b.torso, time_ns, options.gap_ns_max);
    const bool is_near =
        at_a.has_value() && at_b.has_value() && (*at_a - *at_b).norm() <= options.encounter_m;
    if (is_near && !is_open) spans.push_back({time_ns, time_ns});
    if (is_near) spans.back().to_ns = time_ns;
    is_open = is_near;
  }
  return spans;
}

TEST(Encounters, AreThoseThatSamplingFinds) {
  const uint64_t seed = test::TestSeed(53);
  ContactOptions options;
  options.pause_ns = 0;
  size_t found_count = 0;
  for (uint64_t i = 0; i < 40; ++i) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << " stream " << i);
    Random random(seed, i);
    const AgentPath a = Walker(kAda, RandomWalk(&random, 60, 6.0));
    const AgentPath b = Walker(kBen, RandomWalk(&random, 60, 6.0));
    const TimeNs end_ns = std::max(a.torso.back().time_ns, b.torso.back().time_ns);
    const std::vector<Contact> contacts = FindEncounters({a, b}, options);
    // What lasts less than two samples, or stops for less, may be missed by sampling.
    std::vector<Span> exact;
    exact.reserve(contacts.size());
    for (const Contact& contact : contacts) exact.push_back({contact.from_ns, contact.to_ns});
    exact = MergePauses(exact, 2'000'000);
    std::erase_if(exact, [](const Span& span) { return span.to_ns - span.from_ns < 2'000'000; });
    std::vector<Span> sampled = MergePauses(SampleEncounters(a, b, options, end_ns), 2'000'000);
    std::erase_if(sampled, [](const Span& span) { return span.to_ns - span.from_ns < 1'000'000; });
    ASSERT_EQ(exact.size(), sampled.size());
    for (size_t k = 0; k < exact.size(); ++k) {
      EXPECT_NEAR(static_cast<double>(exact[k].from_ns - sampled[k].from_ns), 0.0, 1e6);
      EXPECT_NEAR(static_cast<double>(exact[k].to_ns - sampled[k].to_ns), 0.0, 1e6);
    }
    found_count += exact.size();
  }
  EXPECT_GT(found_count, 40u);
}

TEST(Encounters, EndAtTheLimitAndAreClosestWhereTheySay) {
  const uint64_t seed = test::TestSeed(54);
  ContactOptions options;
  size_t found_count = 0;
  for (uint64_t i = 0; i < 20; ++i) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << " stream " << i);
    Random random(seed, i);
    const AgentPath a = Walker(kAda, RandomWalk(&random, 200, 6.0));
    const AgentPath b = Walker(kBen, RandomWalk(&random, 200, 6.0));
    const auto distance_m = [&](TimeNs time_ns) {
      return (*PositionAt(a.torso, time_ns, options.gap_ns_max) -
              *PositionAt(b.torso, time_ns, options.gap_ns_max))
          .norm();
    };
    for (const Contact& contact : FindEncounters({a, b}, options)) {
      // A nanosecond at 100 m/s, which is faster than two of the walks.
      EXPECT_LE(distance_m(contact.from_ns), options.encounter_m + 1e-7);
      EXPECT_LE(distance_m(contact.to_ns), options.encounter_m + 1e-7);
      EXPECT_NEAR(distance_m(contact.closest_ns), contact.distance_m, 1e-7);
      EXPECT_LE(contact.from_ns, contact.closest_ns);
      EXPECT_LE(contact.closest_ns, contact.to_ns);
      ++found_count;
    }
  }
  EXPECT_GT(found_count, 40u);
}

TEST(Encounters, DoNotDependOnTheOrderOfPaths) {
  const uint64_t seed = test::TestSeed(55);
  Random random(seed, 0);
  std::vector<AgentPath> paths;
  for (uint64_t i = 0; i < 12; ++i) {
    // Three of them have two paths.
    paths.push_back(Walker(NodeId('h', i % 9), RandomWalk(&random, 100, 8.0)));
  }
  const std::vector<Contact> contacts = FindEncounters(paths, {});
  EXPECT_GT(contacts.size(), 50u);
  EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(), [](const auto& a, const auto& b) {
    return std::tie(a.agent, a.other, a.from_ns) < std::tie(b.agent, b.other, b.from_ns);
  }));
  for (int round = 0; round < 5; ++round) {
    std::rotate(paths.begin(), paths.begin() + random.Integer(1, 11), paths.end());
    std::swap(paths[0], paths[static_cast<size_t>(random.Integer(1, 11))]);
    EXPECT_TRUE(AreSame(contacts, FindEncounters(paths, {}))) << "seed " << seed;
  }
}

// How long 60 people of 5000 poses take in a square of an edge.
size_t TimeSixtyPeople(uint64_t seed, double size_m) {
  Random random(seed, 0);
  std::vector<AgentPath> paths;
  for (uint64_t i = 0; i < 60; ++i) {
    paths.push_back(Walker(NodeId('h', i), RandomWalk(&random, 5000, size_m)));
  }
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Contact> contacts = FindEncounters(paths, {});
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  std::printf("60 people x 5000 poses on %.0f m: %zu encounters, %.2f s\n", size_m, contacts.size(),
              taken.count());
  return contacts.size();
}

TEST(Encounters, OfSixtyPeopleAreFoundFarApartAndInACrowd) {
  const uint64_t seed = test::TestSeed(56);
  EXPECT_GT(TimeSixtyPeople(seed, 40.0), 1000u);
  EXPECT_GT(TimeSixtyPeople(seed, 3.0), 1000u);
}

}  // namespace
}  // namespace dsg::ingest
