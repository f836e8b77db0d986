// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/relations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "ingest/objects/near_pairs.h"
#include "schema/base/random.h"
#include "schema/model/edge.h"
#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

std::optional<double> WeightOf(const std::vector<ObjectRelation>& relations_found, int64_t first,
                               const std::string& relation, int64_t second) {
  for (const ObjectRelation& found : relations_found) {
    if (found.first == first && found.relation == relation && found.second == second) {
      return found.weight;
    }
  }
  return std::nullopt;
}

TEST(Relations, PutACupOnATable) {
  const auto found = FindRelations({BoxObject(3, {0.0, 0.0, 0.0}, {1.4, 0.8, 0.75}),
                                    BoxObject(4, {0.6, 0.4, 0.76}, {0.08, 0.08, 0.1})});
  EXPECT_EQ(WeightOf(found, 4, relations::kOn, 3), 1.0);
  EXPECT_NEAR(*WeightOf(found, 3, relations::kNear, 4), 0.01, 1e-9);
  EXPECT_GT(*WeightOf(found, 3, relations::kLargerThan, 4), 100.0);
  EXPECT_EQ(found.size(), 3u);
}

TEST(Relations, PutAThingOnACounterOfWhichOnlyTheFrontWasSeen) {
  const TrackedObject front = BoxObject(1, {0.0, 0.0, 0.0}, {0.07, 2.0, 0.88});
  const TrackedObject machine = BoxObject(2, {0.08, 0.9, 0.89}, {0.3, 0.3, 0.38});
  EXPECT_TRUE(WeightOf(FindRelations({front, machine}), 2, relations::kOn, 1).has_value());
  // What carries it for sure goes before.
  const TrackedObject tray = BoxObject(3, {0.05, 0.8, 0.8}, {0.5, 0.5, 0.09});
  const auto found = FindRelations({front, machine, tray});
  EXPECT_TRUE(WeightOf(found, 2, relations::kOn, 3).has_value());
  EXPECT_FALSE(WeightOf(found, 2, relations::kOn, 1).has_value());
  // Too far behind it, and beside a carpet.
  const TrackedObject behind = BoxObject(4, {0.2, 0.9, 0.89}, {0.3, 0.3, 0.38});
  EXPECT_FALSE(WeightOf(FindRelations({front, behind}), 4, relations::kOn, 1).has_value());
  EXPECT_EQ(CarrierBeside(behind, {front, behind}, {}), 1);
  const TrackedObject lamp = BoxObject(7, {0.2, 0.9, 1.5}, {0.3, 0.3, 0.38});
  EXPECT_FALSE(CarrierBeside(lamp, {front, lamp}, {}).has_value());
  const TrackedObject carpet = BoxObject(5, {0.0, 0.0, 0.0}, {1.0, 1.0, 0.02});
  const TrackedObject chair = BoxObject(6, {1.02, 0.0, 0.0}, {0.5, 0.5, 0.9});
  EXPECT_FALSE(WeightOf(FindRelations({carpet, chair}), 6, relations::kOn, 5).has_value());
}

TEST(Relations, PutABowlInAShelf) {
  TrackedObject shelf = BoxObject(1, {0.0, 0.0, 0.0}, {1.2, 0.36, 1.9});
  const TrackedObject bowl = BoxObject(2, {0.5, 0.1, 0.95}, {0.2, 0.2, 0.1});
  EXPECT_TRUE(WeightOf(FindRelations({shelf, bowl}), 2, relations::kIn, 1).has_value());
  EXPECT_FALSE(WeightOf(FindRelations({shelf, bowl}), 2, relations::kOn, 1).has_value());
  // Boxes alone say the same.
  shelf.cluster.points_map.clear();
  EXPECT_TRUE(WeightOf(FindRelations({shelf, bowl}), 2, relations::kIn, 1).has_value());
}

TEST(Relations, PutACushionOnTheSeatOfAChair) {
  TrackedObject chair = BoxObject(1, {0.0, 0.0, 0.0}, {0.5, 0.5, 0.9});
  const TrackedObject cushion = BoxObject(2, {0.08, 0.15, 0.47}, {0.3, 0.3, 0.1});
  // Seat and back; no top.
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {0.5, 0.5, 0.46}, {}, 0.05);
  mesh.AddBox({0.0, 0.47, 0.45}, {0.5, 0.03, 0.45}, {}, 0.05);
  chair.cluster.points_map = mesh.block().positions_map;
  const auto found = FindRelations({chair, cushion});
  EXPECT_TRUE(WeightOf(found, 2, relations::kOn, 1).has_value());
  EXPECT_FALSE(WeightOf(found, 2, relations::kIn, 1).has_value());
}

TEST(Relations, PutABinUnderADeskNeitherInNorOnIt) {
  TrackedObject desk = BoxObject(1, {0.0, 0.0, 0.0}, {1.4, 0.7, 0.74});
  std::erase_if(desk.cluster.points_map,
                [](const Eigen::Vector3f& point) { return point.z() < 0.7f; });
  const auto found = FindRelations({desk, BoxObject(2, {0.5, 0.2, 0.0}, {0.3, 0.3, 0.4})});
  EXPECT_FALSE(WeightOf(found, 2, relations::kIn, 1).has_value());
  EXPECT_FALSE(WeightOf(found, 2, relations::kOn, 1).has_value());
  EXPECT_EQ(WeightOf(found, 1, relations::kNear, 2), 0.0);
}

TEST(Relations, AreSilentBeyondHalfAMetre) {
  EXPECT_TRUE(FindRelations({BoxObject(1, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}),
                             BoxObject(2, {1.51, 0.0, 0.0}, {0.1, 0.1, 0.1})})
                  .empty());
  EXPECT_EQ(FindRelations({BoxObject(1, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}),
                           BoxObject(2, {1.49, 0.0, 0.0}, {0.9, 0.9, 0.9})})
                .size(),
            1u);
}

TEST(Relations, GiveAnObjectOneSupport) {
  // Two tables side by side; the laptop is over both, mostly over the second.
  const auto found = FindRelations({BoxObject(1, {0.0, 0.0, 0.0}, {1.0, 0.8, 0.75}),
                                    BoxObject(2, {1.0, 0.0, 0.0}, {1.0, 0.8, 0.75}),
                                    BoxObject(3, {0.9, 0.2, 0.75}, {0.35, 0.25, 0.2})});
  EXPECT_FALSE(WeightOf(found, 3, relations::kOn, 1).has_value());
  EXPECT_TRUE(WeightOf(found, 3, relations::kOn, 2).has_value());
}

TEST(Relations, SurviveBoxesWithoutExtent) {
  TrackedObject flat;
  flat.id = 1;
  TrackedObject vast = BoxObject(2, {-1.0, -1.0, -1.0}, {2.0, 2.0, 2.0});
  vast.cluster.size = Vector3d::Constant(1e12);
  const auto found = FindRelations({flat, vast});
  EXPECT_TRUE(WeightOf(found, 1, relations::kNear, 2).has_value());
  EXPECT_TRUE(FindRelations({}).empty());
}

TEST(NearPairs, AreThoseOfComparingAllWithAll) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    std::vector<Box3d> boxes;
    for (int i = 0; i < 120; ++i) {
      const Vector3d low(random.Uniform(-15.0, 15.0), random.Uniform(-15.0, 15.0),
                         random.Uniform(0.0, 3.0));
      const double side_m = random.Chance(0.03) ? 150.0 : 4.0;
      boxes.emplace_back(
          low, low + side_m * Vector3d(random.Uniform(), random.Uniform(), random.Uniform()));
    }
    std::vector<std::pair<int, int>> expected;
    for (int i = 0; i < 120; ++i) {
      for (int j = i + 1; j < 120; ++j) {
        if (DistanceBetween(boxes[static_cast<size_t>(i)], boxes[static_cast<size_t>(j)]) <= 0.5) {
          expected.emplace_back(i, j);
        }
      }
    }
    EXPECT_EQ(NearPairs(boxes, 0.5), expected);
  }
}

std::vector<std::array<int64_t, 3>> Rows(const std::vector<CoVisibility::Pair>& pairs) {
  std::vector<std::array<int64_t, 3>> rows;
  for (const auto& pair : pairs) rows.push_back({pair.first, pair.second, pair.picture_count});
  return rows;
}

using PairRows = std::vector<std::array<int64_t, 3>>;

TEST(CoVisibility, CountsPictures) {
  CoVisibility seen;
  seen.Observe({1, 2, 5});
  seen.Observe({1, 2});
  seen.Observe({});
  seen.Observe({5});
  EXPECT_EQ(Rows(seen.Pairs(1, 10)), (PairRows{{1, 2, 2}, {1, 5, 1}, {2, 5, 1}}));
  EXPECT_EQ(Rows(seen.Pairs(2, 10)), (PairRows{{1, 2, 2}}));
}

TEST(CoVisibility, KeepsTheMostFrequentPartners) {
  CoVisibility seen;
  for (int i = 0; i < 3; ++i) seen.Observe({1, 2});
  for (int i = 0; i < 2; ++i) seen.Observe({1, 3});
  seen.Observe({2, 3});
  // 3 has nobody better than 1; 2 and 3 have both had theirs.
  EXPECT_EQ(Rows(seen.Pairs(1, 1)), (PairRows{{1, 2, 3}, {1, 3, 2}}));
}

TEST(CoVisibility, FollowsMergesAndForgets) {
  CoVisibility seen;
  seen.Observe({1, 2, 3});
  seen.Observe({2, 3});
  seen.Merge(2, 1);
  EXPECT_EQ(Rows(seen.Pairs(1, 10)), (PairRows{{1, 3, 3}}));
  seen.Observe({1, 4});
  seen.Forget(3);
  EXPECT_EQ(Rows(seen.Pairs(1, 10)), (PairRows{{1, 4, 1}}));
}

TEST(CoVisibility, DoesNotGrowWithoutBound) {
  CoVisibility seen;
  for (int i = 0; i < 5; ++i) seen.Observe({1, 2});
  // Each picture shows 200 new things.
  for (int64_t picture = 1; picture <= 40; ++picture) {
    std::vector<int64_t> visible;
    for (int64_t i = 0; i < 200; ++i) visible.push_back(1000 * picture + i);
    seen.Observe(visible);
  }
  EXPECT_LE(seen.Pairs(1, 1000).size(), CoVisibility::kPairCountMax);
  EXPECT_EQ(Rows(seen.Pairs(2, 10)), (PairRows{{1, 2, 5}}));
}

}  // namespace
}  // namespace dsg::ingest
