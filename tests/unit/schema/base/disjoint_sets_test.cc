// SPDX-License-Identifier: Apache-2.0
#include "schema/base/disjoint_sets.h"

#include <gtest/gtest.h>

namespace dsg {
namespace {

TEST(DisjointSets, BeginApartAndMergeOnce) {
  DisjointSets sets(4);
  EXPECT_EQ(sets.Find(3), 3);
  EXPECT_TRUE(sets.Merge(3, 1));
  EXPECT_FALSE(sets.Merge(1, 3));
  EXPECT_EQ(sets.Find(1), sets.Find(3));
  EXPECT_NE(sets.Find(0), sets.Find(3));
}

TEST(DisjointSets, TheLowestMemberIsTheRepresentativeInAnyOrderOfMerges) {
  const std::vector<std::pair<int, int>> merges = {{4, 5}, {2, 4}, {5, 1}, {3, 2}};
  for (const bool is_backwards : {false, true}) {
    DisjointSets sets(6);
    for (size_t i = 0; i < merges.size(); ++i) {
      const auto& [a, b] = merges[is_backwards ? merges.size() - 1 - i : i];
      sets.Merge(a, b);
    }
    for (int member = 1; member < 6; ++member) EXPECT_EQ(sets.Find(member), 1);
    EXPECT_EQ(sets.Find(0), 0);
  }
}

TEST(DisjointSets, Grow) {
  DisjointSets sets;
  EXPECT_EQ(sets.Add(), 0);
  EXPECT_EQ(sets.Add(), 1);
  EXPECT_EQ(sets.size(), 2u);
  EXPECT_TRUE(sets.Merge(0, 1));
}

}  // namespace
}  // namespace dsg
