// SPDX-License-Identifier: Apache-2.0
// Mesh blocks are told ever more rarely while they change, never later than promised, and in the
// end as they are.
#include "ingest/commit/mesh_told.h"

#include <gtest/gtest.h>

#include <map>

#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

constexpr TimeNs kWaitMaxNs = 32 * kNsPerSecond;
constexpr BlockIndex kBlock{1, -2, 3};

TEST(MeshTold, ABlockThatGoesOnChangingIsToldEverMoreRarely) {
  MeshTold told(kWaitMaxNs);
  std::vector<TimeNs> told_s;
  for (TimeNs now_s = 0; now_s <= 130; ++now_s) {
    told.Note(kBlock, true, now_s * kNsPerSecond);
    if (!told.TakeDue(now_s * kNsPerSecond, false).written.empty()) told_s.push_back(now_s);
  }
  EXPECT_EQ(told_s, (std::vector<TimeNs>{2, 7, 16, 33, 66, 99}));
}

TEST(MeshTold, TheLastWordIsToldAtOnceAndOnlyOnce) {
  MeshTold told(kWaitMaxNs);
  told.Note(kBlock, true, 0);
  EXPECT_TRUE(told.TakeDue(0, false).written.empty());
  EXPECT_EQ(told.TakeDue(0, true).written, std::vector<BlockIndex>{kBlock});
  EXPECT_TRUE(told.TakeDue(kNsPerSecond, true).written.empty());
}

TEST(MeshTold, ASurfaceThatIsLostIsRemovedIfItWasTold) {
  MeshTold told(kWaitMaxNs);
  told.Note(kBlock, true, 0);
  told.Note(kBlock, false, kNsPerSecond);
  const MeshTold::Due nothing = told.TakeDue(3 * kNsPerSecond, false);
  EXPECT_TRUE(nothing.written.empty());
  EXPECT_TRUE(nothing.removed.empty());
  told.Note(kBlock, true, 4 * kNsPerSecond);
  ASSERT_EQ(told.TakeDue(60 * kNsPerSecond, false).written.size(), 1u);
  told.Note(kBlock, false, 61 * kNsPerSecond);
  EXPECT_EQ(told.TakeDue(120 * kNsPerSecond, false).removed, std::vector<BlockIndex>{kBlock});
}

// What a reader sees of each block is the block as it was at most the longest wait ago, and at the
// end as it is.
TEST(MeshTold, NoReaderIsFurtherBehindThanPromised) {
  Random random(5, 0);
  MeshTold told(kWaitMaxNs);
  std::map<BlockIndex, TimeNs> untold_since;
  TimeNs now_ns = 0;
  for (int step = 0; step < 5000; ++step) {
    now_ns += kNsPerSecond;
    for (int i = 0; i < 3; ++i) {
      const BlockIndex index{random.Index(40), 0, 0};
      told.Note(index, true, now_ns);
      untold_since.try_emplace(index, now_ns);
    }
    for (const BlockIndex& index : told.TakeDue(now_ns, false).written) untold_since.erase(index);
    for (const auto& [index, since_ns] : untold_since) ASSERT_LT(now_ns - since_ns, kWaitMaxNs);
  }
  for (const BlockIndex& index : told.TakeDue(now_ns, true).written) untold_since.erase(index);
  EXPECT_TRUE(untold_since.empty());
}

}  // namespace
}  // namespace dsg::ingest
