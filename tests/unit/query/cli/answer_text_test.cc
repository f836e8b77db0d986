// SPDX-License-Identifier: Apache-2.0
#include "query/cli/answer_text.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::cli {
namespace {

TimeText On(Clock clock, TimeNs epoch_ns) {
  MapSpec map;
  map.clock = clock;
  map.epoch_ns = epoch_ns;
  return TimeText(map);
}

constexpr TimeNs kJune2014 = 1'403'715'524 * kNsPerSecond;

TEST(TimeText, ShowsDatesOnUnixClocksOnly) {
  EXPECT_EQ(On(Clock::kUnix, kJune2014).Full(kJune2014 + 500'000'000),
            "+0.5s (2014-06-25T16:58:44.5Z)");
  EXPECT_EQ(On(Clock::kMonotonic, kJune2014).Full(kJune2014 + 500'000'000), "+0.5s");
  EXPECT_EQ(On(Clock::kPtpTai, kJune2014).Date(kJune2014), "");
}

TEST(TimeText, OpenEndsAreNotDates) {
  const TimeText times = On(Clock::kUnix, kJune2014);
  EXPECT_EQ(times.Full(kTimeMax), "open");
  EXPECT_EQ(times.Span(kTimeMin, kTimeMax), "");
  EXPECT_EQ(times.Span(kJune2014, kTimeMax), "+0s (2014-06-25T16:58:44Z) to open");
}

TEST(TimeText, TimeOutsideTrackSaysWhereTheTrackIs) {
  const absl::Status status = MakeError(Reason::kTimeOutsideTrack, "no pose of H1",
                                        {{"first_ns", "2000000000"}, {"last_ns", "9500000000"}});
  const absl::Status explained = On(Clock::kMonotonic, 0).Explain(status);
  EXPECT_EQ(explained, MakeError(Reason::kTimeOutsideTrack,
                                 "no pose of H1 (the track: +2s to +9.5s)", MetadataOf(status)));
}

TEST(TimeText, AnInvertedRangeIsToldAsItWasGiven) {
  const absl::Status status =
      MakeError(Reason::kTimeRangeInverted, "from_ns 60000000000 is not before to_ns 30000000000",
                {{"from_ns", "60000000000"}, {"to_ns", "30000000000"}});
  const absl::Status explained = On(Clock::kMonotonic, 0).Explain(status);
  EXPECT_EQ(ReasonOf(explained), Reason::kTimeRangeInverted);
  EXPECT_EQ(MetadataOf(explained), MetadataOf(status));
  const std::string message(explained.message());
  EXPECT_EQ(message.find("--from +60s is not before --to +30s; "), 0U) << message;
  EXPECT_NE(message.find("give an earlier --from or a later --to"), std::string::npos);
}

TEST(TimeText, OtherErrorsPassUnchanged) {
  const TimeText times = On(Clock::kMonotonic, 0);
  EXPECT_TRUE(times.Explain(absl::OkStatus()).ok());
  const absl::Status bare = MakeError(Reason::kTimeOutsideTrack, "m", {{"first_ns", "x"}});
  EXPECT_EQ(times.Explain(bare), bare);
  EXPECT_EQ(times.Explain(absl::NotFoundError("m")), absl::NotFoundError("m"));
}

TEST(TimeText, TenthsAreTheNearest) {
  const TimeText times = On(Clock::kMonotonic, 30'000'000);
  EXPECT_EQ(times.Tenth(30'000'000 + 83'999'914'236), "+84s");
  EXPECT_EQ(times.Tenth(30'000'000 + 84'049'999'999), "+84s");
  EXPECT_EQ(times.Tenth(30'000'000 - 160'000'000), "-0.2s");
  EXPECT_EQ(times.Tenth(kTimeMax), "open");
}

TEST(TimeText, DurationsHaveNoSign) { EXPECT_EQ(DurationText(5, 5 + 2 * kNsPerSecond), "2s"); }

TEST(AnswerText, SecondsHaveAllDecimals) {
  EXPECT_EQ(SecondsText(1'403'715'524'907'143'168), "1403715524.907143168");
  EXPECT_EQ(SecondsText(0), "0.000000000");
  EXPECT_EQ(SecondsText(-1), "-0.000000001");
  EXPECT_EQ(SecondsText(kTimeMin), "-9223372036.854775808");
}

}  // namespace
}  // namespace dsg::cli
