// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "schema/base/random.h"
#include "schema/merge/footprint.h"
#include "schema/merge/fuse.h"
#include "schema/merge/origins.h"
#include "schema/model/edge.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

Polygon2d Square(double x, double y, double side) {
  return {{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}};
}

TEST(Footprint, MeasuresWhatTwoOutlinesShare) {
  EXPECT_DOUBLE_EQ(SignedArea(Square(0, 0, 2)), 4.0);
  EXPECT_NEAR(SharedArea(Square(0, 0, 2), Square(1, 1, 2)), 1.0, 1e-9);
  EXPECT_EQ(SharedArea(Square(0, 0, 2), Square(5, 5, 2)), 0.0);
  EXPECT_EQ(SharedArea(Square(0, 0, 2), {}), 0.0);
  EXPECT_NEAR(std::abs(SignedArea(UnionOf(Square(0, 0, 2), Square(1, 1, 2)))), 7.0, 1e-9);
}

TEST(Footprint, TakesAnyPolygonThereIs) {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed, 4);
    const auto draw = [&] {
      Polygon2d outline;
      for (int i = random.Integer(3, 12); i > 0; --i) {
        outline.emplace_back(random.Uniform(0, 3), random.Uniform(0, 3));
      }
      return outline;
    };
    const Polygon2d a = draw();
    const Polygon2d b = draw();
    const double shared = SharedArea(a, b);
    EXPECT_GE(shared, 0.0) << seed;
    EXPECT_LE(shared, 9.0) << seed;
    EXPECT_LE(std::abs(SignedArea(UnionOf(a, b))), 9.0) << seed;
  }
}

TEST(Origins, AreReadBackAsTheyWereSet) {
  Node node;
  SetOrigin({"home", NodeId('O', 3), 5, true, {4, 12}, 0xfedcba9876543210u, 7}, &node);
  const auto copy = CopiedFrom(node);
  ASSERT_TRUE(copy.has_value());
  EXPECT_EQ(copy->revisions, (std::vector<Revision>{4, 12}));
  EXPECT_EQ(copy->seen_mark, 0xfedcba9876543210u);
  EXPECT_EQ(copy->written_mark, 7u);
  SetOrigin({"lab", NodeId('O', 9), 2, false, {}, 0, 0}, &node);
  EXPECT_FALSE(CopiedFrom(node).has_value());
  SetOrigin({"home", NodeId('O', 3), 8, true, {13}, 1, 0}, &node);
  const std::vector<Origin> origins = OriginsOf(node);
  ASSERT_EQ(origins.size(), 2u);
  EXPECT_EQ(origins[0].map, "home");
  EXPECT_EQ(origins[0].observation_count, 8);
  EXPECT_TRUE(origins[0].is_copy);
  EXPECT_EQ(origins[1].id, NodeId('O', 9));
  EXPECT_EQ(origins[1].observation_count, 2);
  EXPECT_EQ(std::get<std::string>(node.attributes.at("merged_from")), "home/O3 lab/O9");
}

TEST(Origins, WithoutWhatOlderProgramsDidNotWriteAreReadToo) {
  Node node;
  node.attributes["merged_from"] = std::string("home/O3 lab/O4");
  node.attributes["merged_counts"] = std::string("new:57 x@,:?");
  const std::vector<Origin> origins = OriginsOf(node);
  ASSERT_EQ(origins.size(), 2u);
  EXPECT_EQ(origins[0].observation_count, 57);
  EXPECT_TRUE(origins[0].revisions.empty());
  EXPECT_EQ(origins[1].observation_count, 0);
  EXPECT_EQ(origins[1].seen_mark, 0u);
}

TEST(Origins, OfAttributesThatSomebodyElseWroteAreNone) {
  Node node;
  for (const AttributeValue& value :
       {AttributeValue(3.0), AttributeValue(true), AttributeValue(std::string("O4")),
        AttributeValue(std::string("home/ home/?? / //")), AttributeValue(std::string())}) {
    node.attributes["merged_from"] = value;
    EXPECT_TRUE(OriginsOf(node).empty());
  }
}

Origin Of(const Node& seen) { return {"b", seen.id, 0, false, {1}, 1, 0}; }

TEST(Fuse, KeepsTheBetterLookAndCountsEachObservationOnce) {
  Node known = test::MakeObject(1, "chair", {1, 1, 0});
  Node seen = test::MakeObject(8, "chair", {1.1, 1, 0});
  seen.observation_count = 30;
  seen.last_observed_ns = 99;
  seen.confidence = 0.7;
  FuseNode("a", Of(seen), false, seen, &known);
  EXPECT_EQ(known.id, test::O(1));
  EXPECT_NEAR(known.map_T_node.position.x(), 1.1, 1e-12);
  EXPECT_EQ(known.observation_count, 40);
  EXPECT_EQ(known.last_observed_ns, 99);
  EXPECT_EQ(known.confidence, 0.7);
  FuseNode("a", Of(seen), true, seen, &known);
  EXPECT_EQ(known.observation_count, 40);
}

TEST(Fuse, CountsOnceWhatCameByTwoWays) {
  Node known = test::MakeObject(1, "chair", {1, 1, 0});
  Node seen = test::MakeObject(8, "chair", {1, 1, 0});
  // Of its 10, 4 were taken from `known`, and 5 from a third map, of which 3 are known already.
  SetOrigin({"a", known.id, 4, false, {}, 0, 0}, &seen);
  SetOrigin({"c", test::O(2), 5, false, {}, 0, 0}, &seen);
  SetOrigin({"c", test::O(2), 3, false, {}, 0, 0}, &known);
  FuseNode("a", Of(seen), false, seen, &known);
  EXPECT_EQ(known.observation_count, 10 + 1 + 2);
}

TEST(Fuse, CountsUpToTheEndOfNumbers) {
  Node known = test::MakeObject(1, "chair", {1, 1, 0});
  Node seen = test::MakeObject(8, "chair", {1, 1, 0});
  known.observation_count = std::numeric_limits<int64_t>::max() - 5;
  seen.observation_count = std::numeric_limits<int64_t>::max() - 5;
  FuseNode("a", Of(seen), false, seen, &known);
  EXPECT_EQ(known.observation_count, std::numeric_limits<int64_t>::max());
}

}  // namespace
}  // namespace dsg::merge
