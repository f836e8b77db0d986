// SPDX-License-Identifier: Apache-2.0
// How frames become times: exactly, from the smallest frame, by the commonest step.
#include "ingest/log/frame_clock.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

TrackTable Table(const std::vector<int64_t>& frames) {
  TrackTable table;
  table.file = "log.txt";
  int64_t line = 0;
  for (const int64_t frame : frames) {
    const int32_t agent = table.FindOrAdd(std::to_string(line), kinds::kHuman);
    table.AddPosition(frame, ++line, agent, Eigen::Vector3d::Zero());
  }
  return table;
}

TEST(FrameClock, CountsFromTheSmallestFrameInCommonestSteps) {
  TrackTable table = Table({786, 780, 792, 930, 936});
  LogOptions options;
  options.epoch_ns = 1000;
  ASSERT_TRUE(ApplyFrameClock(options, &table).ok());
  EXPECT_EQ(table.rows[0].time_ns, 1000 + 400'000'000);
  EXPECT_EQ(table.rows[1].time_ns, 1000);
  EXPECT_EQ(table.rows[3].time_ns, 1000 + 25 * int64_t{400'000'000});
}

TEST(FrameClock, RoundsPartsOfAStepToTheNearestNanosecond) {
  TrackTable table = Table({0, 3, 6, 7});
  LogOptions options;
  options.frame_period_ns = 1'000'000'000;
  ASSERT_TRUE(ApplyFrameClock(options, &table).ok());
  EXPECT_EQ(table.rows[3].time_ns, 2'333'333'333);
}

TEST(FrameClock, TakesOneFrameForTheEpoch) {
  TrackTable table = Table({41});
  ASSERT_TRUE(ApplyFrameClock({}, &table).ok());
  EXPECT_EQ(table.rows[0].time_ns, 0);
}

TEST(FrameClock, RefusesTimesThatDoNotFit) {
  TrackTable table = Table({0, 1, 2, int64_t{1} << 52});
  EXPECT_EQ(ReasonOf(ApplyFrameClock({}, &table)), Reason::kFileMalformed);
}

TEST(FrameClock, RefusesAPeriodThatPutsTwoFramesOnOneInstant) {
  TrackTable table;
  table.file = "log.txt";
  const int32_t agent = table.FindOrAdd("1", kinds::kHuman);
  int64_t line = 0;
  for (const int64_t frame : {0, 10, 20, 21}) {
    table.AddPosition(frame, ++line, agent, Eigen::Vector3d(double(frame), 0, 0));
  }
  LogOptions options;
  options.frame_period_ns = 1;
  EXPECT_EQ(ReasonOf(ApplyFrameClock(options, &table)), Reason::kFileMalformed);
}

}  // namespace
}  // namespace dsg::ingest
