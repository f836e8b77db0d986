// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/render_frames.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

namespace dsg::simulator {
namespace {

TEST(ForEachInParallel, VisitsEachIndexOnceAndEndsAtOne) {
  std::vector<std::atomic<int>> visits(1000);
  double last_share = 0.0;
  const absl::Status status = ForEachInParallel(
      1000, 4, "counting",
      [&](const char* step, double share) {
        EXPECT_STREQ(step, "counting");
        EXPECT_GT(share, last_share);
        last_share = share;
      },
      [&](int64_t index) {
        ++visits[static_cast<size_t>(index)];
        return absl::OkStatus();
      });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(last_share, 1.0);
  for (const std::atomic<int>& count : visits) EXPECT_EQ(count, 1);
}

TEST(ForEachInParallel, StopsAtTheFirstErrorAndReturnsIt) {
  std::atomic<int> done_count = 0;
  const absl::Status status = ForEachInParallel(1'000'000, 4, "failing", nullptr, [&](int64_t i) {
    ++done_count;
    return i == 10 ? absl::UnavailableError("the tenth") : absl::OkStatus();
  });
  EXPECT_EQ(status.message(), "the tenth");
  EXPECT_LT(done_count, 1'000'000);
}

TEST(ForEachInParallel, DoesNothingForNothing) {
  EXPECT_TRUE(ForEachInParallel(0, 4, "nothing", nullptr, [](int64_t) {
                return absl::InternalError("called");
              }).ok());
}

}  // namespace
}  // namespace dsg::simulator
