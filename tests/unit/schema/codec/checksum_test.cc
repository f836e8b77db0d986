// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/checksum.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace dsg
