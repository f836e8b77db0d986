// SPDX-License-Identifier: Apache-2.0
#include "query/cli/progress.h"

#include <gtest/gtest.h>

#include <sstream>

namespace dsg::cli {
namespace {

class ProgressTest : public testing::Test {
 protected:
  void Pass(std::chrono::milliseconds time) { now_ += time; }

  Progress::Clock::time_point now_;
  std::ostringstream out_;
  Progress progress_{"import", &out_, [this] { return now_; }};
};

TEST_F(ProgressTest, ShortTasksAreSilent) {
  Pass(std::chrono::milliseconds(1999));
  progress_.Update(1.0);
  EXPECT_EQ(out_.str(), "");
}

TEST_F(ProgressTest, LongTasksSayHowFarAndHowLong) {
  Pass(std::chrono::seconds(2));
  progress_.Update(0.25);
  EXPECT_EQ(out_.str(), "import: 25 %, 6 s left\n");
}

TEST_F(ProgressTest, LinesAreTwoSecondsApart) {
  Pass(std::chrono::seconds(2));
  progress_.Update(0.25);
  Pass(std::chrono::seconds(1));
  progress_.Update(0.4);
  Pass(std::chrono::seconds(1));
  progress_.Update(0.5);
  EXPECT_EQ(out_.str(), "import: 25 %, 6 s left\nimport: 50 %, 4 s left\n");
}

TEST_F(ProgressTest, NothingIsForetoldFromAlmostNothing) {
  Pass(std::chrono::seconds(3));
  progress_.Update(0.001);
  EXPECT_EQ(out_.str(), "import: 0 %\n");
}

}  // namespace
}  // namespace dsg::cli
