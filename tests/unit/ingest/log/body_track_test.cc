// SPDX-License-Identifier: Apache-2.0
// Poses out of transforms: the same in whatever order the frames come, and only as many as wait.
#include "ingest/log/body_track.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "schema/base/status.h"

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
  EXPECT_TRUE(track.Add(Transform("odom", 10 * kStep, 100), "").ok());
  EXPECT_TRUE(track.Add(Transform("/odom", 30 * kStep, 120), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 20 * kStep, 1), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 40 * kStep, 2), "").ok());
  EXPECT_TRUE(track.Add(Transform("wheel", 99 * kStep, 2), "").ok());
  EXPECT_EQ(track.known_ns(), 30 * kStep);
  const auto pose = track.Next();
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->time_ns, 20 * kStep);
  EXPECT_EQ(pose->root_T_body.position.x(), 111);
  EXPECT_FALSE(track.Next().has_value()) << "the map may move until then";
  EXPECT_TRUE(track.Add(Transform("odom", 50 * kStep, 130), "").ok());
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 127);
  EXPECT_TRUE(track.Add(Transform("base", 60 * kStep, 3), "").ok());
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
    for (const RosPose& transform : all) EXPECT_TRUE(whole.Add(transform, "").ok());
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
      EXPECT_TRUE(growing.Add(transform, "").ok());
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
  EXPECT_TRUE(track.Add(Transform("base", 20 * kStep, 1), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 20 * kStep, 1), "").ok());
  EXPECT_EQ(track.passed_over_count(), 0) << "a repeat says nothing else";
  EXPECT_TRUE(track.Add(Transform("base", 20 * kStep, 2), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 10 * kStep, 1), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 30 * kStep, NAN), "").ok());
  EXPECT_EQ(track.passed_over_count(), 3);
  EXPECT_EQ(track.waiting_count(), 1u);
}

TEST(BodyTrack, GivesUpWhatIsTooOld) {
  BodyTrack track = BaseInMap();
  EXPECT_TRUE(track.Add(Transform("odom", 10 * kStep, 0), "").ok());
  EXPECT_TRUE(track.Add(Transform("odom", 11 * kStep, 1), "").ok());
  for (int i = 2; i < 6; ++i) EXPECT_TRUE(track.Add(Transform("base", i * 10 * kStep, 0), "").ok());
  EXPECT_FALSE(track.Next(45 * kStep).has_value()) << "it moves, so nobody knows where it is";
  track.SkipBefore(45 * kStep);
  EXPECT_EQ(track.skipped_count(), 3);
  EXPECT_EQ(track.waiting_count(), 1u);
  track.SkipBefore(70 * kStep);
  EXPECT_TRUE(track.Add(Transform("base", 65 * kStep, 0), "").ok());
  EXPECT_EQ(track.late_count(), 1);
  EXPECT_EQ(track.skipped_count(), 4);
  EXPECT_TRUE(track.Add(Transform("base", 70 * kStep, 3), "").ok());
  EXPECT_TRUE(track.Add(Transform("odom", 90 * kStep, 1), "").ok());
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 4);
}

TEST(BodyTrack, DoesNotWaitForWhatStands) {
  BodyTrack track = BaseInMap(/*is_repeated=*/false);
  EXPECT_TRUE(track.Add(Transform("odom", 10 * kStep, 5), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 20 * kStep, 1), "").ok());
  EXPECT_EQ(track.Next()->root_T_body.position.x(), 6) << "it came once, and need not come again";
  EXPECT_TRUE(track.Add(Transform("odom", 30 * kStep, 5), "").ok());
  EXPECT_TRUE(track.Add(Transform("base", 40 * kStep, 1), "").ok());
  EXPECT_FALSE(track.Next().has_value());
  EXPECT_FALSE(track.Next(39 * kStep).has_value());
  EXPECT_EQ(track.Next(40 * kStep)->root_T_body.position.x(), 6) << "it has never moved";
}

TEST(BodyTrack, IsBoundedInMemory) {
  BodyTrack track = BaseInMap(/*is_repeated=*/true, 100);
  for (int i = 1; i < 1000; ++i) EXPECT_TRUE(track.Add(Transform("base", i * kStep, 0), "").ok());
  EXPECT_EQ(track.waiting_count(), 100u);
  EXPECT_EQ(track.skipped_count(), 899);
  for (int i = 1; i < 1000; ++i) EXPECT_TRUE(track.Add(Transform("odom", i * kStep, i), "").ok());
  const auto pose = track.Next();
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->time_ns, 900 * kStep);
  EXPECT_EQ(pose->root_T_body.position.x(), 900);
}

// Without this all that came after the jump would be passed over.
TEST(BodyTrack, RefusesAClockThatHasJumped) {
  BodyTrack track = BaseInMap();
  EXPECT_TRUE(track.Add(Transform("base", 10 * kStep, 1), "message 1").ok());
  EXPECT_TRUE(track.Add(Transform("base", 9000 * kStep, 1), "message 2").ok());
  for (int i = 1; i < kStepsBackMax; ++i) {
    ASSERT_TRUE(track.Add(Transform("base", (10 + i) * kStep, 1), "message 3").ok()) << i;
  }
  const absl::Status status = track.Add(Transform("base", 99 * kStep, 1), "message 22");
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed);
  EXPECT_NE(status.message().find("message 22 has stamp 99000000"), std::string::npos) << status;
  EXPECT_NE(status.message().find("stamp 9000000000 of message 2:"), std::string::npos) << status;
}

TEST(BodyTrack, TakesPublishersThatTakeTurns) {
  BodyTrack track = BaseInMap();
  for (int i = 1; i < 5 * kStepsBackMax; ++i) {
    ASSERT_TRUE(track.Add(Transform("base", 10 * i * kStep, 1), "").ok()) << i;
    ASSERT_TRUE(track.Add(Transform("base", (10 * i - 3) * kStep, 1), "").ok()) << i;
  }
  EXPECT_EQ(track.passed_over_count(), 5 * kStepsBackMax - 1);
}

}  // namespace
}  // namespace dsg::ingest
