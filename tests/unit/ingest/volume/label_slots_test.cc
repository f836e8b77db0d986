// SPDX-License-Identifier: Apache-2.0
// Four slots decide as a vector over all classes does, and forget in as many looks.
#include "ingest/volume/label_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "ingest/volume/voxel_meaning.h"
#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

TEST(LabelSlots, RecoversFromFiveWrongLooks) {
  LabelSlots<uint16_t> slots;
  for (int i = 0; i < 5; ++i) slots.Add(7);
  EXPECT_EQ(slots.Best(), 7u);
  for (int i = 0; i < 5; ++i) slots.Add(9);
  EXPECT_EQ(slots.Best(), 7u) << "a tie changes nothing";
  slots.Add(9);
  EXPECT_EQ(slots.Best(), 9u);
}

TEST(LabelSlots, KeepsItsLeaderWhenCountersAreFull) {
  LabelSlots<uint32_t> slots;
  for (int i = 0; i < 1000; ++i) slots.Add(i % 3 == 0 ? 70'000 : 80'000);
  EXPECT_EQ(slots.Best(), 80'000u);
  EXPECT_LE(slots.votes(slots.BestSlot()), 255u);
}

TEST(LabelSlots, LetsANewIdInWhenAllSlotsAreTaken) {
  LabelSlots<uint16_t> slots;
  for (uint32_t id = 1; id <= 4; ++id) slots.Add(id);
  for (int i = 0; i < 3; ++i) slots.Add(200);
  EXPECT_EQ(slots.Best(), 200u);
}

// Voxels between two classes seen from 5 to 60 times, with a fifth of the labels wrong.
TEST(LabelSlots, DecideAsTheFullBayesianVectorDoes) {
  constexpr int kVoxels = 20'000;
  constexpr int kClasses = 40;
  constexpr uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  Random random(kSeed, 0);
  int equal = 0;
  for (int voxel = 0; voxel < kVoxels; ++voxel) {
    const int truth = random.Integer(1, kClasses);
    const int neighbour = random.Integer(1, kClasses);
    const double mixed = random.Chance(0.3) ? random.Uniform(0.0, 0.4) : 0.0;
    LabelSlots<uint16_t> slots;
    std::array<int, kClasses + 1> votes{};
    const int looks = random.Integer(5, 60);
    for (int i = 0; i < looks; ++i) {
      int seen = random.Chance(mixed) ? neighbour : truth;
      if (random.Chance(0.2)) seen = random.Integer(1, kClasses);
      slots.Add(static_cast<uint32_t>(seen));
      ++votes[seen];
    }
    // With one confidence for all classes, the log posterior is the votes times a constant.
    equal += votes[slots.Best()] == *std::max_element(votes.begin(), votes.end()) ? 1 : 0;
  }
  EXPECT_GE(equal, kVoxels * 995 / 1000);
}

TEST(VoxelMeaning, NamesNoClassThatIsLessLikelyThanNot) {
  VoxelLabels labels;
  labels.classes.Add(5);
  EXPECT_EQ(VoxelMeaning(0.8).ClassOf(labels), 5u);
  EXPECT_EQ(VoxelMeaning(0.4).ClassOf(labels), 0u);
  labels.classes.Add(5);
  EXPECT_EQ(VoxelMeaning(0.4).ClassOf(labels), 5u);
  labels.classes.Add(6);
  labels.classes.Add(6);
  EXPECT_EQ(VoxelMeaning(0.8).ClassOf(labels), 5u) << "the first of two equals";
}

TEST(VoxelMeaning, CountsTheVotesOfJoinedInstancesTogether) {
  InstanceBook book;
  const uint32_t chair = book.Add(3);
  const uint32_t other = book.Add(3);
  const uint32_t same = book.Add(3);
  const uint32_t table = book.Add(4);
  VoxelLabels labels;
  for (const uint32_t id : {other, other, chair, same, table, table, table}) {
    labels.instances.Add(id);
  }
  EXPECT_EQ(VoxelMeaning::InstanceOf(labels, 3, book), other);
  book.Join(chair, same);
  EXPECT_EQ(VoxelMeaning::InstanceOf(labels, 3, book), chair);
  EXPECT_EQ(VoxelMeaning::InstanceOf(labels, 4, book), table);
  EXPECT_EQ(VoxelMeaning::InstanceOf(labels, 5, book), 0u);
}

}  // namespace
}  // namespace dsg::ingest
