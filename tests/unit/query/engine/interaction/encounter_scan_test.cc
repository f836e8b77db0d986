// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/encounters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "schema/base/random.h"

namespace dsg::query {
namespace {

constexpr TimeNs kSecond = kNsPerSecond;

TrackPath Line(uint64_t agent, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return {NodeId('H', agent), 2 * kSecond, {{0, from}, {kSecond, to}}};
}

// A walk with steps of uneven length, some of them too long to be joined.
TrackPath RandomWalk(uint64_t agent, Random* random) {
  TrackPath path{NodeId('H', agent), kSecond, {}};
  TimeNs time_ns = static_cast<TimeNs>(random->Uniform(0, 3) * kSecond);
  Eigen::Vector3d at(random->Uniform(0, 6), random->Uniform(0, 6), 1);
  for (int i = 0; i < 150; ++i) {
    path.points.push_back({time_ns, at});
    const double step_s = random->Chance(0.05) ? 3.0 : random->Uniform(0.05, 0.9);
    time_ns += static_cast<TimeNs>(step_s * kSecond);
    at += Eigen::Vector3d(random->Uniform(-0.7, 0.7), random->Uniform(-0.7, 0.7), 0);
  }
  return path;
}

std::optional<Eigen::Vector3d> NaivePosition(const TrackPath& path, TimeNs at_ns) {
  for (size_t i = 0; i + 1 < path.points.size(); ++i) {
    const TrackPoint& a = path.points[i];
    const TrackPoint& b = path.points[i + 1];
    if (at_ns < a.time_ns || at_ns >= b.time_ns) continue;
    if (b.time_ns - a.time_ns > path.gap_ns_max) return std::nullopt;
    const double u =
        static_cast<double>(at_ns - a.time_ns) / static_cast<double>(b.time_ns - a.time_ns);
    return (1.0 - u) * a.position_map + u * b.position_map;
  }
  return std::nullopt;
}

bool Holds(const std::vector<Meeting>& meetings, TimeNs at_ns) {
  for (const Meeting& meeting : meetings) {
    if (meeting.during.Contains(at_ns)) return true;
  }
  return false;
}

TEST(EncounterScan, FindsTheExactInstantsOfAPassage) {
  // Past each other 1 m apart at 10 m/s: within 2 m while |x| < sqrt(3).
  const TrackPath a = Line(1, {0, 0, 0}, {0, 0, 0});
  const TrackPath b = Line(2, {-5, 1, 0}, {5, 1, 0});
  const auto meetings = FindMeetings(a, b, {0, kSecond}, 2.0);
  ASSERT_EQ(meetings.size(), 1u);
  const double half_s = std::sqrt(3.0) / 10.0;
  EXPECT_NEAR(static_cast<double>(meetings[0].during.from_ns), (0.5 - half_s) * 1e9, 1.0);
  EXPECT_NEAR(static_cast<double>(meetings[0].during.to_ns), (0.5 + half_s) * 1e9, 1.0);
  EXPECT_EQ(meetings[0].closest_ns, kSecond / 2);
  EXPECT_DOUBLE_EQ(meetings[0].distance_m_min, 1.0);
  EXPECT_NEAR(meetings[0].middle_map.y(), 0.5, 1e-12);
}

TEST(EncounterScan, DoesNotTakeTouchingForMeeting) {
  const TrackPath a = Line(1, {0, 0, 0}, {0, 0, 0});
  EXPECT_TRUE(FindMeetings(a, Line(2, {-5, 2, 0}, {5, 2, 0}), {0, kSecond}, 2.0).empty());
  EXPECT_TRUE(FindMeetings(a, Line(2, {2, 0, 0}, {2, 0, 0}), {0, kSecond}, 2.0).empty());
}

TEST(EncounterScan, EqualsDenseSamplingOnRandomTracks) {
  const uint64_t seed = 11;
  for (uint64_t round = 0; round < 40; ++round) {
    Random random(seed, round);
    const TrackPath a = RandomWalk(1, &random);
    const TrackPath b = RandomWalk(2, &random);
    const Interval during{5 * kSecond, 60 * kSecond};
    const auto meetings = FindMeetings(a, b, during, 1.5);
    std::vector<double> least(meetings.size(), 1e9);
    for (TimeNs t = 0; t < 70 * kSecond; t += 7'000'001) {
      const auto at_a = NaivePosition(a, t);
      const auto at_b = NaivePosition(b, t);
      const bool is_known = at_a.has_value() && at_b.has_value() && during.Contains(t);
      const double distance = is_known ? (*at_a - *at_b).norm() : 1e9;
      if (is_known && std::abs(distance - 1.5) < 1e-6) continue;
      ASSERT_EQ(Holds(meetings, t), is_known && distance < 1.5)
          << "seed " << seed << ", round " << round << " at " << t;
      for (size_t i = 0; i < meetings.size(); ++i) {
        if (meetings[i].during.Contains(t)) least[i] = std::min(least[i], distance);
      }
    }
    for (size_t i = 0; i < meetings.size(); ++i) {
      EXPECT_LE(meetings[i].distance_m_min, least[i] + 1e-9);
      if (i > 0) {
        EXPECT_GT(meetings[i].during.from_ns, meetings[i - 1].during.to_ns);
      }
      EXPECT_TRUE(meetings[i].during.Contains(meetings[i].closest_ns));
    }
  }
}

TEST(EncounterScan, CandidatesHoldEveryMeetingOfManyTracks) {
  const uint64_t seed = 12;
  Random random(seed, 0);
  std::vector<TrackPath> paths;
  for (uint64_t i = 0; i < 12; ++i) paths.push_back(RandomWalk(i, &random));
  const Interval during{3 * kSecond, 50 * kSecond};
  const auto candidates = FindCandidates(paths, during, 1.0, -1);
  size_t meeting_count = 0;
  for (int32_t i = 0; i < 12; ++i) {
    for (int32_t j = i + 1; j < 12; ++j) {
      std::vector<Meeting> found;
      for (const MeetingCandidate& one : candidates) {
        if (one.first != i || one.second != j) continue;
        const auto part = FindMeetings(paths[static_cast<size_t>(i)], paths[static_cast<size_t>(j)],
                                       one.during, 1.0);
        for (const Meeting& meeting : part) JoinMeeting(meeting, &found);
      }
      const auto whole =
          FindMeetings(paths[static_cast<size_t>(i)], paths[static_cast<size_t>(j)], during, 1.0);
      ASSERT_EQ(found.size(), whole.size());
      meeting_count += whole.size();
      for (size_t k = 0; k < whole.size(); ++k) {
        EXPECT_EQ(found[k].during, whole[k].during);
        EXPECT_DOUBLE_EQ(found[k].distance_m_min, whole[k].distance_m_min);
      }
    }
  }
  EXPECT_GT(meeting_count, 20u);
}

}  // namespace
}  // namespace dsg::query
