// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/instance_shuffle.h"

#include <gtest/gtest.h>

#include <set>

namespace dsg::simulator {
namespace {

TEST(InstanceShuffle, GivesEachInstanceAnotherNumberAndLeavesZero) {
  InstanceShuffle shuffle(6, 3);
  std::set<int> numbers;
  for (int instance = 1; instance < 256; ++instance) {
    const int number = shuffle.Shuffled(11, instance);
    EXPECT_GE(number, 1);
    EXPECT_LE(number, 255);
    numbers.insert(number);
  }
  EXPECT_EQ(numbers.size(), 255u);
  EXPECT_EQ(shuffle.Shuffled(11, 0), 0);
}

TEST(InstanceShuffle, TellsNothingFromOneImageToTheNext) {
  int same_count = 0;
  for (int64_t image = 0; image < 100; ++image) {
    InstanceShuffle a(6, image);
    InstanceShuffle b(6, image + 1);
    same_count += a.Shuffled(40, 2) == b.Shuffled(40, 2) ? 1 : 0;
  }
  EXPECT_LT(same_count, 5);
}

TEST(InstanceShuffle, ChangesLabelsAsItSays) {
  ingest::Image labels{3, 1, ingest::PixelFormat::kLabel16, {2, 11, 0, 1, 2, 12}};
  InstanceShuffle shuffle(6, 3);
  shuffle.Apply(&labels);
  EXPECT_EQ(labels.bytes[0], shuffle.Shuffled(11, 2));
  EXPECT_EQ(labels.bytes[4], shuffle.Shuffled(12, 2));
  EXPECT_EQ(ingest::LabelAt(labels, 1, 0), 1 << 8);
  EXPECT_EQ(labels.bytes[1], 11);
  EXPECT_EQ(labels.bytes[5], 12);
}

}  // namespace
}  // namespace dsg::simulator
