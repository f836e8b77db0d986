// SPDX-License-Identifier: Apache-2.0
// Poses out of transforms: the same in whatever order the frames come, and only as many as wait.
#include "ingest/log/body_track.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace dsg::ingest {
namespace {

constexpr TimeNs kStep = 1'000'000;

RosPose Transform(const std::string& child, TimeNs time_ns, double x, double half_turn = 0.0) {
  RosPose transform;
  transform.header.stamp_ns = time_ns;
  transform.child_frame_id = child;
  transform.position = {x, 0, 0};
  transform.xyzw = {0, 0, std::sin(half_turn), std::cos(half_turn)};
  return transform;
}

// base in odom, which drives, in map.
BodyTrack BaseInMap(bool is_repeated = true, size_t waiting_max = SIZE_MAX) {
  ChainFrame base{.name = "base", .parent = "odom", .parent_T_frame = {}, .has_track = true};
  ChainFrame odom{.name = "odom", .parent = "map", .parent_T_frame = {}, .has_track = true};
  base.is_repeated = odom.is_repeated = is_repeated;
  return BodyTrack({base, odom, {.name = "map", .parent = "", .parent_T_frame = {}}}, 0,
                   waiting_max);
}

TEST(BodyTrack, WaitsForTheFramesAbove) {
  BodyTrack track = BaseInMap();
  EXPECT_EQ(track.Name(), "/tf, frame \"base\" in \"map\"");
  track.Add(Transform("odom", 10 * kStep, 100), "");
  track.Add(Transform("/odom", 30 * kStep, 120), "");
  track.Add(Transform("base", 20 * kStep, 1), "");
  track.Add(Transform("base", 40 * kStep, 2), "");
  track.Add(Transform("wheel", 99 * kStep, 2), "");
  EXPECT_EQ(track.known_ns(), 30 * kStep);
  const auto pose = track.Next();
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->time_ns, 20 * kStep);
  EXPECT_EQ(pose->root_T_body.position.x(), 111);
  EXPECT_FALSE(track.Next().has_value()) << "the map may move until then";
  track.Add(Transform("odom", 50 * kStep, 130), "");
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 127);
  track.Add(Transform("base", 60 * kStep, 3), "");
  EXPECT_FALSE(track.Next().has_value());
  EXPECT_EQ(track.NextAtEnd()->root_T_body.position.x(), 133) << "the map stands then";
  EXPECT_FALSE(track.NextAtEnd().has_value());
}

TEST(BodyTrack, GivesTheSameHoweverItsTransformsCome) {
  constexpr unsigned kSeed = 5;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  for (int round = 0; round < 50; ++round) {
    std::vector<RosPose> all;
    for (const std::string child : {"base", "odom"}) {
      TimeNs time_ns = static_cast<TimeNs>(random() % 50) * kStep;
      for (int i = 0; i < 40; ++i) {
        time_ns += static_cast<TimeNs>(1 + random() % (child == "base" ? 20 : 60)) * kStep;
        all.push_back(Transform(child, time_ns, 1e-3 * static_cast<double>(random() % 10'000),
                                1e-3 * static_cast<double>(random() % 1000)));
      }
    }
    BodyTrack whole = BaseInMap();
    for (const RosPose& transform : all) whole.Add(transform, "");
    // By their stamps, which are up to 300 ms older than when they come.
    std::vector<std::pair<TimeNs, RosPose>> in_order;
    TimeNs late_ns = 0;
    for (const RosPose& transform : all) {
      if (transform.child_frame_id == "odom") late_ns = 300 * kStep;
      in_order.emplace_back(transform.header.stamp_ns + late_ns, transform);
    }
    std::stable_sort(in_order.begin(), in_order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    BodyTrack growing = BaseInMap();
    std::vector<BodyPose> poses;
    for (const auto& [time_ns, transform] : in_order) {
      growing.Add(transform, "");
      while (const auto pose = growing.Next()) poses.push_back(*pose);
    }
    while (const auto pose = growing.NextAtEnd()) poses.push_back(*pose);
    ASSERT_EQ(poses.size(), 40u);
    for (const BodyPose& pose : poses) {
      const auto expected = whole.NextAtEnd();
      ASSERT_TRUE(expected.has_value());
      EXPECT_EQ(pose.time_ns, expected->time_ns);
      EXPECT_TRUE(IsSamePose(pose.root_T_body, expected->root_T_body)) << pose.time_ns;
    }
  }
}

TEST(BodyTrack, CountsWhatItPassesOver) {
  BodyTrack track = BaseInMap();
  track.Add(Transform("base", 20 * kStep, 1), "");
  track.Add(Transform("base", 20 * kStep, 1), "");
  EXPECT_EQ(track.passed_over_count(), 0) << "a repeat says nothing else";
  track.Add(Transform("base", 20 * kStep, 2), "");
  track.Add(Transform("base", 10 * kStep, 1), "");
  track.Add(Transform("base", 30 * kStep, NAN), "");
  EXPECT_EQ(track.passed_over_count(), 3);
  EXPECT_EQ(track.waiting_count(), 1u);
}

TEST(BodyTrack, GivesUpWhatIsTooOld) {
  BodyTrack track = BaseInMap();
  track.Add(Transform("odom", 10 * kStep, 0), "");
  track.Add(Transform("odom", 11 * kStep, 1), "");
  for (int i = 2; i < 6; ++i) track.Add(Transform("base", i * 10 * kStep, 0), "");
  EXPECT_FALSE(track.Next(45 * kStep).has_value()) << "it moves, so nobody knows where it is";
  track.SkipBefore(45 * kStep);
  EXPECT_EQ(track.skipped_count(), 3);
  EXPECT_EQ(track.waiting_count(), 1u);
  track.SkipBefore(70 * kStep);
  track.Add(Transform("base", 65 * kStep, 0), "");
  EXPECT_EQ(track.late_count(), 1);
  EXPECT_EQ(track.skipped_count(), 4);
  track.Add(Transform("base", 70 * kStep, 3), "");
  track.Add(Transform("odom", 90 * kStep, 1), "");
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 4);
}

TEST(BodyTrack, DoesNotWaitForWhatStands) {
  BodyTrack track = BaseInMap(/*is_repeated=*/false);
  track.Add(Transform("odom", 10 * kStep, 5), "");
  track.Add(Transform("base", 20 * kStep, 1), "");
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 6) << "it came once, and need not come again";
  track.Add(Transform("odom", 30 * kStep, 5), "");
  track.Add(Transform("base", 40 * kStep, 1), "");
  EXPECT_FALSE(track.Next().has_value());
  EXPECT_FALSE(track.Next(39 * kStep).has_value());
  EXPECT_EQ(track.Next(40 * kStep)->root_T_body.position.x(), 6) << "it has never moved";
}

TEST(BodyTrack, IsBoundedInMemory) {
  BodyTrack track = BaseInMap(/*is_repeated=*/true, 100);
  for (int i = 1; i < 1000; ++i) track.Add(Transform("base", i * kStep, 0), "");
  EXPECT_EQ(track.waiting_count(), 100u);
  EXPECT_EQ(track.skipped_count(), 899);
  for (int i = 1; i < 1000; ++i) track.Add(Transform("odom", i * kStep, i), "");
  const auto pose = track.Next();
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->time_ns, 900 * kStep);
  EXPECT_EQ(pose->root_T_body.position.x(), 900);
}

}  // namespace
}  // namespace dsg::ingest
