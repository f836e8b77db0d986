// SPDX-License-Identifier: Apache-2.0
// What progress lines say.
#include "ingest/program/progress.h"

#include <gtest/gtest.h>

namespace dsg::ingest {
namespace {

TEST(FormatProgress, ShowsShareRateAndTimeLeft) {
  EXPECT_EQ(FormatProgress("obsmat.txt", 50, 100, 2.0),
            "[############............] 50 % obsmat.txt 50 of 100, 25/s, 2.0s left");
  EXPECT_EQ(FormatProgress("obsmat.txt", 100, 100, 2.0),
            "[########################] 100 % obsmat.txt 100 of 100, 50/s, 0.0s left");
}

TEST(FormatProgress, SaysWhatItKnowsWithoutATotalOrATime) {
  EXPECT_EQ(FormatProgress("log", 50, 0, 2.0), "log 50, 25/s");
  EXPECT_EQ(FormatProgress("log", 0, 10, 0.0),
            "[........................] 0 % log 0 of 10, 0/s, ? left");
}

TEST(FormatDuration, ChangesToMinutes) {
  EXPECT_EQ(FormatDuration(3.21), "3.2s");
  EXPECT_EQ(FormatDuration(65.0), "1m05s");
}

}  // namespace
}  // namespace dsg::ingest
