// SPDX-License-Identifier: Apache-2.0
#include "schema/base/time.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg {
namespace {

constexpr TimeNs kEpoch = 1403715524907143168;

TEST(ParseTime, ReadsNanosecondsExactly) {
  EXPECT_EQ(*ParseTime("1403715524907143168", 0), kEpoch);
  EXPECT_EQ(*ParseTime("-5", 100), -5);
  EXPECT_EQ(*ParseTime("9223372036854775807", 0), kTimeMax);
}

TEST(ParseTime, ReadsOffsetsFromTheEpochWithoutRounding) {
  EXPECT_EQ(*ParseTime("+12.5s", kEpoch), kEpoch + 12'500'000'000);
  EXPECT_EQ(*ParseTime("+0.000000001s", kEpoch), kEpoch + 1);
  EXPECT_EQ(*ParseTime("+0.1", 0), 100'000'000);
  EXPECT_EQ(*ParseTime("-200ms", 0), -200'000'000);
  EXPECT_EQ(*ParseTime("+3m", 0), 180 * kNsPerSecond);
  EXPECT_EQ(*ParseTime("+1.5h", 0), 5400 * kNsPerSecond);
  EXPECT_EQ(*ParseTime("+1m10s", 0), 70 * kNsPerSecond);
  EXPECT_EQ(*ParseTime("-1d2h3min4.5s6ms", 0), -(93'784'506 * kNsPerSecond / 1000));
}

TEST(ParseTime, ReadsRfc3339) {
  EXPECT_EQ(*ParseTime("2014-06-25T16:58:44.907143168Z", 0), 1403715524907143168);
  EXPECT_EQ(*ParseTime("1970-01-01T01:00:00+01:00", 0), 0);
}

TEST(ParseTime, RefusesWhatItDoesNotUnderstand) {
  for (const char* text :
       {"", "+", "-", "+s", "+1x", "12.5", "noon", "+99999999999999999999s", "2014-13-01T00:00:00Z",
        "9223372036854775808", "+300000000000s", "9999-01-01T00:00:00Z", "+1.5 s", "+10s1m",
        "+1m1m", "+1h30", "+1m.s", "+1m-2s", "+200000d99999h"}) {
    const auto time = ParseTime(text, kEpoch);
    EXPECT_EQ(ReasonOf(time.status()), Reason::kFieldInvalid) << text;
  }
}

TEST(ParseTime, ReadsBackWhatFormatRelativeWrites) {
  for (const TimeNs offset : {TimeNs{0}, TimeNs{1}, TimeNs{-1}, TimeNs{1'500'000'000},
                              TimeNs{-2'000'000'001}, TimeNs{123'456'789'012'345}}) {
    EXPECT_EQ(*ParseTime(FormatRelative(kEpoch + offset, kEpoch), kEpoch), kEpoch + offset);
  }
}

TEST(FormatTime, WritesAsManyDecimalsAsNeeded) {
  EXPECT_EQ(FormatRfc3339(kEpoch), "2014-06-25T16:58:44.907143168Z");
  EXPECT_EQ(FormatRfc3339(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(FormatRelative(kEpoch + 12'500'000'000, kEpoch), "+12.5s");
  EXPECT_EQ(FormatRelative(kEpoch, kEpoch), "+0s");
}

TEST(Interval, IsHalfOpen) {
  const Interval interval{10, 20};
  EXPECT_FALSE(interval.Contains(9));
  EXPECT_TRUE(interval.Contains(10));
  EXPECT_FALSE(interval.Contains(20));
  EXPECT_TRUE(interval.Overlaps({19, 30}));
  EXPECT_FALSE(interval.Overlaps({20, 30}));
}

}  // namespace
}  // namespace dsg
