// SPDX-License-Identifier: Apache-2.0
#include "query/cli/values.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/status.h"

namespace dsg::cli {
namespace {

TEST(Values, ReadsPointsAndBoxes) {
  EXPECT_EQ(*ParsePoint("POSITION", "-1.5,2e1,0"), Eigen::Vector3d(-1.5, 20.0, 0.0));
  const Box3d box = *ParseBox("--box", "0,0,0,1,2,3");
  EXPECT_EQ(box.min(), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(box.max(), Eigen::Vector3d(1, 2, 3));
}

TEST(Values, RefusesIncompleteOrStrangeNumbersNamingTheOption) {
  for (const char* text : {"", "1,2", "1,2,3,4", "1,2,x", "1,,3", "1 2 3"}) {
    const auto point = ParsePoint("POSITION", text);
    ASSERT_FALSE(point.ok()) << text;
    EXPECT_EQ(ReasonOf(point.status()), Reason::kFieldInvalid) << text;
    EXPECT_EQ(MetadataOf(point.status())["field"], "POSITION");
  }
  EXPECT_EQ(ReasonOf(ParsePoint("POSITION", "nan,0,0").status()), Reason::kNumberNotFinite);
  EXPECT_EQ(ReasonOf(ParsePoint("POSITION", "0,0,-inf").status()), Reason::kNumberNotFinite);
}

TEST(Values, RefusesInvertedBoxes) {
  EXPECT_EQ(ReasonOf(ParseBox("--box", "0,0,0,1,-1,1").status()), Reason::kBoxInverted);
}

TEST(Values, ReadsPosesWithAndWithoutRotation) {
  const auto plain = ParsePose("--pose", "-1,2,3");
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->position, Eigen::Vector3d(-1.0, 2.0, 3.0));
  const auto turned = ParsePose("--pose", "0,0,0,0,0,3,3");
  ASSERT_TRUE(turned.ok());
  EXPECT_NEAR(turned->orientation.z(), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(ReasonOf(ParsePose("--pose", "1,2").status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(ParsePose("--pose", "1,2,3,4").status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(ParsePose("--pose", "1,2,3,0,0,0,0").status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(ParsePose("--pose", "1,2,nan").status()), Reason::kNumberNotFinite);
}

TEST(Values, ReadsDurations) {
  EXPECT_EQ(*ParseDuration("--every", "0.5s"), kNsPerSecond / 2);
  EXPECT_EQ(*ParseDuration("--every", "200ms"), 200'000'000);
  EXPECT_EQ(*ParseDuration("--every", "2"), 2 * kNsPerSecond);
  EXPECT_EQ(*ParseDuration("--every", "1m10s"), 70 * kNsPerSecond);
}

TEST(Values, RefusesDurationsThatAreNotAboveZero) {
  for (const char* text :
       {"", "0", "0s", "-1s", "+1s", "fast", "10s1m", "1m10", "2014-06-25T16:58:44Z"}) {
    EXPECT_EQ(ReasonOf(ParseDuration("--every", text).status()), Reason::kFieldInvalid) << text;
  }
}

MapSpec MapWith(TimeNs epoch_ns, Clock clock) {
  MapSpec map;
  map.epoch_ns = epoch_ns;
  map.clock = clock;
  return map;
}

constexpr TimeNs kIn2014 = 1'403'715'524'907'143'168;

TEST(Values, InstantsAreRelativeToTheEpochAndNameTheirOption) {
  const MapSpec map = MapWith(100, Clock::kMonotonic);
  EXPECT_EQ(*ParseInstant("--at", "+12.5s", map), 12'500'000'100);
  EXPECT_EQ(*ParseInstant("--at", "+12.5", map), 12'500'000'100);
  EXPECT_EQ(*ParseInstant("--at", "12500000100", map), 12'500'000'100);
  const auto bad = ParseInstant("--from", "soon", map);
  EXPECT_EQ(ReasonOf(bad.status()), Reason::kFieldInvalid);
  EXPECT_EQ(bad.status().message().substr(0, 8), "--from: ");
}

TEST(Values, NumbersThatMayBeSecondsAreNoInstants) {
  for (const char* text : {"30", "-30", "0", "1403715524", "1403715524907"}) {
    const absl::Status status = ParseInstant("--at", text, MapWith(kIn2014, Clock::kUnix)).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << text;
    EXPECT_NE(status.message().find(std::string(text) + "s (from the map's epoch)"),
              std::string::npos)
        << status;
    EXPECT_NE(status.message().find("a date like 2014-"), std::string::npos) << status;
  }
  const MapSpec simulated = MapWith(0, Clock::kUnix);
  EXPECT_EQ(ReasonOf(ParseInstant("--at", "30", simulated).status()), Reason::kFieldInvalid);
  EXPECT_EQ(*ParseInstant("--at", "30ns", simulated), 30);
  EXPECT_EQ(*ParseInstant("--at", "0", simulated), 0);
  EXPECT_EQ(*ParseInstant("--at", "30000000000", simulated), 30 * kNsPerSecond);
  EXPECT_EQ(*ParseInstant("--at", "1403715524907143168", MapWith(kIn2014, Clock::kUnix)), kIn2014);
}

TEST(Values, WhatIsNoInstantIsRefusedWithWhatToWrite) {
  const auto said = [](const std::string& text, const MapSpec& map) {
    const absl::Status status = ParseInstant("--at", text, map).status();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << text;
    return std::string(status.message());
  };
  const MapSpec map = MapWith(kIn2014, Clock::kMonotonic);
  EXPECT_EQ(said("30", map),
            "--at: 30 has no unit: write +30s (from the map's epoch), 30ns (on the map's clock)");
  EXPECT_EQ(said("-30", map), "--at: -30 has no unit: write -30s (from the map's epoch)");
  EXPECT_EQ(said("12.5", map), "--at: 12.5 has no unit: write +12.5s (from the map's epoch)");
  EXPECT_EQ(said("1m10s", map), "--at: 1m10s has no sign: write +1m10s (from the map's epoch)");
  EXPECT_EQ(said("30s", MapWith(kIn2014, Clock::kUnix)),
            "--at: 30s has no sign: write +30s (from the map's epoch), or a date like "
            "2014-06-25T16:58:44.907143168Z");
  // What is written so is an instant.
  EXPECT_EQ(*ParseInstant("--at", "+30s", map), kIn2014 + 30 * kNsPerSecond);
  EXPECT_EQ(*ParseInstant("--at", "30ns", map), 30);
  EXPECT_EQ(*ParseInstant("--at", "-30s", map), kIn2014 - 30 * kNsPerSecond);
  EXPECT_EQ(*ParseInstant("--at", "+1m10s", map), kIn2014 + 70 * kNsPerSecond);
}

TEST(Values, DatesAreInstantsOnAClockThatIsUtcOnly) {
  constexpr char kDate[] = "2014-06-25T16:58:44.907143168Z";
  EXPECT_EQ(*ParseInstant("--at", kDate, MapWith(0, Clock::kUnix)), kIn2014);
  for (const Clock clock : {Clock::kPtpTai, Clock::kMonotonic}) {
    EXPECT_EQ(ReasonOf(ParseInstant("--at", kDate, MapWith(kIn2014, clock)).status()),
              Reason::kFieldInvalid);
    EXPECT_EQ(*ParseInstant("--at", "+1s", MapWith(kIn2014, clock)), kIn2014 + kNsPerSecond);
  }
}

}  // namespace
}  // namespace dsg::cli
