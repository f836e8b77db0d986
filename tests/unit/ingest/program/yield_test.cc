// SPDX-License-Identifier: Apache-2.0
// Which logs give a map nothing, and what is said about them.
#include "ingest/program/yield.h"

#include <gtest/gtest.h>

#include "absl/strings/match.h"

namespace dsg::ingest {
namespace {

LogInfo Info() {
  LogInfo info;
  info.path = "walk.bag";
  info.format = "rosbag";
  return info;
}

// Of a log of the robot alone, whose frames are all skipped for these reasons.
IngestSummary Lost(const SkipCounts& skipped) {
  IngestSummary summary;
  summary.agent_count = 1;
  summary.given_count = 100;
  summary.committed.revision_count = 2;
  summary.mapping.emplace();
  summary.mapping->skipped = skipped;
  return summary;
}

void ExpectNothing(const IngestSummary& summary, const std::vector<std::string>& words) {
  const absl::Status status = CheckYield(Info(), summary);
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_TRUE(absl::StrContains(status.message(), "walk.bag (rosbag) gives the map nothing"))
      << status;
  for (const std::string& word : words) {
    EXPECT_TRUE(absl::StrContains(status.message(), word)) << word << ": " << status;
  }
}

TEST(Yield, IsNothingWithoutPosesAndNodes) {
  ExpectNothing(IngestSummary(), {"no poses and no nodes"});
  IngestSummary summary;
  summary.unused = {{"imu0", 300}, {"cam0", 20}};
  ExpectNothing(summary, {"cam0 20", "imu0 300", "--pose-file"});
}

TEST(Yield, IsSomethingIfTheMapHasItAlready) {
  IngestSummary summary;
  summary.given_count = 1;
  EXPECT_EQ(CheckYield(Info(), summary), absl::OkStatus());
  summary = IngestSummary();
  summary.was_known = true;
  EXPECT_EQ(CheckYield(Info(), summary), absl::OkStatus());
}

TEST(Yield, IsNothingIfAllFramesAreLost) {
  ExpectNothing(Lost({{"pose jump", 48}, {"no pose", 2}, {"broken pose", 7}}),
                {"all its frames are lost (no pose 2, pose jump 48)", "20 m/s", "--pose-file",
                 "--no-layers"});
  IngestSummary blind = Lost({});
  blind.mapping->volume.frame_count = 9;
  ExpectNothing(blind, {"without a pixel of usable depth 9"});
}

TEST(Yield, IsSomethingIfAFrameWasUsed) {
  IngestSummary summary = Lost({{"pose jump", 48}});
  summary.mapping->volume.frame_count = 1;
  summary.mapping->volume.pixel_count = 1;
  EXPECT_EQ(CheckYield(Info(), summary), absl::OkStatus());
}

TEST(Yield, IsSomethingIfThereWereNoFramesToLose) {
  EXPECT_EQ(CheckYield(Info(), Lost({})), absl::OkStatus());
  EXPECT_EQ(CheckYield(Info(), Lost({{"colour left out: size", 3}, {"broken pose", 1}})),
            absl::OkStatus());
}

TEST(Yield, IsSomethingIfPeopleWereSeen) {
  IngestSummary summary = Lost({{"pose jump", 48}});
  summary.agent_count = 2;
  EXPECT_EQ(CheckYield(Info(), summary), absl::OkStatus());
}

TEST(Yield, HintsNameTheOptionThatHelps) {
  EXPECT_TRUE(HintsOnLostFrames({}).empty());
  EXPECT_TRUE(HintsOnLostFrames({{"broken image", 3}, {"pose jump", 0}}).empty());
  const std::vector<std::string> hints = HintsOnLostFrames({{"pose jump", 1}, {"no pose", 5}});
  ASSERT_EQ(hints.size(), 2u);
  EXPECT_EQ(hints[0].rfind("no pose: ", 0), 0u);
  EXPECT_EQ(hints[1].rfind("pose jump: ", 0), 0u);
  for (const std::string& hint : hints) EXPECT_TRUE(absl::StrContains(hint, "--pose-file"));
}

}  // namespace
}  // namespace dsg::ingest
