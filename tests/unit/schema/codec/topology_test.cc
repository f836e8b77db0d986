// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/topology.h"

#include <gtest/gtest.h>

namespace dsg {
namespace {

TEST(Topology, ComesBack) {
  const Topology topology{4, {{0, 1, 2}, {2, 1, 3}}};
  Topology kept;
  ASSERT_TRUE(DecodeTopology(EncodeTopology(topology), &kept));
  EXPECT_EQ(kept, topology);
  EXPECT_EQ(EncodeTopology(topology).size(), 8u + 24u);
}

TEST(Topology, RefusesFacesOfVerticesThatAreNotThere) {
  Topology kept;
  EXPECT_FALSE(DecodeTopology(EncodeTopology({3, {{0, 1, 3}}}), &kept));
}

TEST(Topology, RefusesBytesOfAnotherLength) {
  const std::string bytes = EncodeTopology({3, {{0, 1, 2}}});
  Topology kept;
  EXPECT_FALSE(DecodeTopology("", &kept));
  EXPECT_FALSE(DecodeTopology(bytes.substr(0, bytes.size() - 1), &kept));
  EXPECT_FALSE(DecodeTopology(bytes + "x", &kept));
  EXPECT_FALSE(DecodeTopology(std::string(8, '\xff'), &kept));
}

}  // namespace
}  // namespace dsg
