// SPDX-License-Identifier: Apache-2.0
// A long path: its old poses wait on disk, all of them come back to the last bit, and memory does
// not grow with it.
#include "ingest/trajectory/pose_list.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>

#include "ingest/trajectory/robot_path.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/open_files.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

using test::TempFolder;

constexpr TimeNs kStepNs = 5'000'000;

// Some with covariances, which come in runs as logs have them.
TimedPose PoseAt(size_t index, Random* random) {
  TimedPose pose;
  pose.time_ns = static_cast<TimeNs>(index) * kStepNs;
  pose.flags = index % 3 == 0 ? pose_flags::kNoOrientation : 0;
  for (int axis = 0; axis < 3; ++axis) {
    pose.map_T_agent.position[axis] = random->Uniform(-100.0, 100.0);
  }
  pose.map_T_agent.orientation =
      Eigen::AngleAxisd(random->Uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ());
  if (index % 1000 < 500) {
    Covariance6 covariance{};
    covariance[0] = static_cast<float>(index / 50);
    pose.covariance = std::make_shared<const Covariance6>(covariance);
  }
  return pose;
}

void ExpectSame(const TimedPose& a, const TimedPose& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(a.map_T_agent.position, b.map_T_agent.position);
  EXPECT_EQ(a.map_T_agent.orientation.coeffs(), b.map_T_agent.orientation.coeffs());
  ASSERT_EQ(a.covariance == nullptr, b.covariance == nullptr);
  if (a.covariance != nullptr) {
    EXPECT_EQ(*a.covariance, *b.covariance);
  }
}

TEST(PoseList, GivesAllBack) {
  const uint64_t seed = test::TestSeed(5);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  const TempFolder folder;
  PoseList list(folder.path());
  std::vector<TimedPose> wanted;
  for (size_t i = 0; i < 6 * PoseList::kPageSize + 100; ++i) {
    wanted.push_back(PoseAt(i, &random));
    list.Add(wanted.back());
  }
  EXPECT_EQ(test::OpenFilesIn(folder.path()).size(), 1u);
  ASSERT_EQ(list.size(), wanted.size());
  ExpectSame(list.front(), wanted.front());
  ExpectSame(list.back(), wanted.back());
  for (size_t i = 0; i < wanted.size(); i += 7) ExpectSame(list[i], wanted[i]);
  const auto end_ns = static_cast<double>(wanted.back().time_ns);
  for (int i = 0; i < 2000; ++i) {
    const auto time_ns = static_cast<TimeNs>(random.Uniform(-0.1, 1.1) * end_ns);
    const TimeNs asked_ns = i % 2 == 0 ? time_ns : time_ns / kStepNs * kStepNs;
    const auto found = std::lower_bound(
        wanted.begin(), wanted.end(), asked_ns,
        [](const TimedPose& pose, TimeNs other_ns) { return pose.time_ns < other_ns; });
    EXPECT_EQ(list.NotBefore(asked_ns), static_cast<size_t>(found - wanted.begin())) << asked_ns;
  }
  EXPECT_TRUE(list.status().ok()) << list.status();
}

// An hour at 200 Hz; all poses at once would take 70 MB.
TEST(PoseList, TakesNoMoreMemoryTheLongerItIs) {
  Random random(1, 0);
  PoseList list;
  size_t before = 0;
  for (size_t i = 0; i < 720'000; ++i) {
    list.Add(PoseAt(i, &random));
    if (i == 20'000) before = mallinfo2().uordblks;
  }
  EXPECT_LT(mallinfo2().uordblks, before + 1'500'000);
  EXPECT_TRUE(list.status().ok()) << list.status();
}

// As a path does with its poses.
TEST(PoseList, AnswersAsAPathDoes) {
  RobotPath path;
  for (size_t i = 0; i < 3 * PoseList::kPageSize; ++i) {
    TimedPose pose;
    pose.time_ns = static_cast<TimeNs>(i) * kStepNs;
    pose.map_T_agent.position.x() = 0.001 * static_cast<double>(i);
    ASSERT_TRUE(path.Add(pose));
  }
  Pose3d pose;
  ASSERT_EQ(path.At(10 * kStepNs + kStepNs / 2, &pose), RobotPath::Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 0.0105, 1e-12);
  // Between the last pose of a page and the first of the next.
  const auto edge = static_cast<TimeNs>(PoseList::kPageSize);
  ASSERT_EQ(path.At(edge * kStepNs - kStepNs / 4, &pose), RobotPath::Answer::kKnown);
  EXPECT_NEAR(pose.position.x(), 0.001 * (static_cast<double>(edge) - 0.25), 1e-12);
  EXPECT_EQ(path.NearestIndex(edge * kStepNs - kStepNs / 4), PoseList::kPageSize);
  EXPECT_EQ(path.NearestIndex(edge * kStepNs - 3 * kStepNs / 4), PoseList::kPageSize - 1);
  EXPECT_NEAR(path.GivenNear(-kStepNs).position.x(), 0.0, 1e-12);
}

TEST(PoseList, TellsThatTheDiskIsFullAndLosesNothing) {
  Random random(2, 0);
  const TempFolder folder;
  PoseList list(folder.path());
  const test::FullDisk full(100'000);
  for (size_t i = 0; i < 3 * PoseList::kPageSize; ++i) list.Add(PoseAt(i, &random));
  EXPECT_EQ(ReasonOf(list.status()), Reason::kDiskFull) << list.status();
  EXPECT_EQ(list.size(), 3 * PoseList::kPageSize);
  EXPECT_EQ(list[5].time_ns, 5 * kStepNs);
}

TEST(PoseList, RefusesWhatTheDiskHasChanged) {
  Random random(3, 0);
  const TempFolder folder;
  PoseList list(folder.path());
  for (size_t i = 0; i < 3 * PoseList::kPageSize; ++i) list.Add(PoseAt(i, &random));
  const std::vector<int> open = test::OpenFilesIn(folder.path());
  ASSERT_EQ(open.size(), 1u);
  ASSERT_EQ(pwrite(open[0], "other", 5, 1000), 5);
  EXPECT_EQ(list[0].map_T_agent.position, Eigen::Vector3d::Zero());
  EXPECT_TRUE(absl::IsDataLoss(list.status())) << list.status();
}

}  // namespace
}  // namespace dsg::ingest
