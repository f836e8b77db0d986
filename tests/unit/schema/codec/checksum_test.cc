// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/checksum.h"

#include <gtest/gtest.h>

#include <string>

#include "schema/codec/delta_checksum.h"

namespace dsg {
namespace {

TEST(ContentDigest, DoesNotDependOnOrderAndUndoesWhatIsRemoved) {
  ContentDigest first;
  first.Add("a");
  first.Add("b");
  ContentDigest second;
  second.Add("b");
  second.Add("c");
  second.Add("a");
  EXPECT_FALSE(first == second);
  second.Remove("c");
  EXPECT_TRUE(first == second);
}

TEST(ContentDigest, CountsEqualRowsTwice) {
  ContentDigest once;
  once.Add("a");
  ContentDigest twice = once;
  twice.Add("a");
  EXPECT_FALSE(once == twice);
}

TEST(ContentDigest, SumsAndSurvivesItsBytes) {
  ContentDigest a;
  a.Add("x");
  ContentDigest b;
  b.Add("y");
  ContentDigest sum = a;
  sum += b;
  EXPECT_TRUE(ContentDigest::FromBytes(sum.bytes()) == sum);
  sum -= a;
  EXPECT_TRUE(sum == b);
}

TEST(Sha256, IsTheStandardOne) {
  EXPECT_EQ(ToHex(ComputeSha256("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Checksum, DependsOnTheSeed) { EXPECT_NE(Checksum("abc", 1), Checksum("abc", 2)); }

// Stores keep it, so that a delta that is sent again by a later build is still known.
TEST(DeltaChecksum, StaysWhatItIs) {
  GraphDelta delta;
  delta.labels.push_back({3, "chair"});
  // Longer than what is gathered at once.
  delta.labels.push_back({4, std::string(5000, 'x')});
  TrajectoryAppend append;
  append.agent = NodeId(7);
  for (int i = 0; i < 100; ++i) {
    TimedPose pose;
    pose.time_ns = 1000 * i;
    pose.map_T_agent.position = {0.5 * i, -1.0, 2.0};
    append.poses.push_back(pose);
  }
  delta.appends.push_back(append);
  constexpr int64_t kStored = 7908801847562944023;
  EXPECT_EQ(DeltaChecksum(delta), kStored);
  delta.appends[0].poses.back().time_ns += 1;
  EXPECT_NE(DeltaChecksum(delta), kStored);
}

}  // namespace
}  // namespace dsg
