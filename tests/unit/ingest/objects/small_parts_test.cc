// SPDX-License-Identifier: Apache-2.0
// The parts that clusters are made by: connected points, boxes, floors, nearest points.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "ingest/objects/euclidean_clusters.h"
#include "ingest/objects/floor_levels.h"
#include "ingest/objects/point_index.h"
#include "ingest/objects/upright_box.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

std::vector<WeightedPoint> Weighted(const std::vector<Vector3f>& points) {
  std::vector<WeightedPoint> weighted;
  for (const Vector3f& point : points) weighted.push_back({point, 1.0f});
  return weighted;
}

std::vector<Vector3f> RandomPoints(uint64_t seed, int count, double side_m) {
  Random random(seed, 0);
  std::vector<Vector3f> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(
        (side_m * Vector3d(random.Uniform(), random.Uniform(), random.Uniform())).cast<float>());
  }
  return points;
}

// Clusters by flooding all pairs.
std::vector<std::vector<int>> FloodClusters(const std::vector<Vector3f>& points,
                                            float tolerance_m) {
  std::vector<std::vector<int>> clusters;
  std::vector<bool> is_done(points.size(), false);
  for (size_t seed = 0; seed < points.size(); ++seed) {
    if (is_done[seed]) continue;
    std::vector<int> members{static_cast<int>(seed)};
    is_done[seed] = true;
    for (size_t next = 0; next < members.size(); ++next) {
      for (size_t i = 0; i < points.size(); ++i) {
        if (is_done[i]) continue;
        if ((points[i] - points[static_cast<size_t>(members[next])]).norm() > tolerance_m) continue;
        is_done[i] = true;
        members.push_back(static_cast<int>(i));
      }
    }
    std::sort(members.begin(), members.end());
    clusters.push_back(members);
  }
  return clusters;
}

TEST(EuclideanClusters, AreThoseOfFlooding) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto points = RandomPoints(seed, 400, 2.0);
    const auto clusters = EuclideanClusters(points, 0.15);
    EXPECT_GT(clusters.size(), 5u);
    EXPECT_EQ(clusters, FloodClusters(points, 0.15f));
  }
  EXPECT_TRUE(EuclideanClusters({}, 0.1).empty());
}

TEST(PointIndex, FindsTheNearest) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto points = RandomPoints(seed, 300, 1.0);
    const PointIndex index(points);
    for (const Vector3f& query : RandomPoints(seed + 100, 100, 1.2)) {
      const PointIndex::Hit hit = index.Nearest(query);
      const auto nearest =
          std::min_element(points.begin(), points.end(), [&](const Vector3f& a, const Vector3f& b) {
            return (a - query).norm() < (b - query).norm();
          });
      EXPECT_EQ(hit.index, nearest - points.begin());
      EXPECT_NEAR(hit.distance_m, (*nearest - query).norm(), 1e-5f);
    }
  }
  EXPECT_EQ(PointIndex({}).Nearest(Vector3f::Zero()).index, -1);
}

TEST(UprightBox, StaysUprightForLittleGain) {
  TestMesh round;
  // A disc: no direction is better than another.
  for (double angle = 0.0; angle < 6.28; angle += 0.02) {
    round.AddVertex({std::cos(angle), std::sin(angle), 0.0}, Vector3d::UnitZ(), {});
  }
  EXPECT_EQ(LeastFootprintYaw(round.block().positions_map), 0.0);
  TestMesh corner;
  // Two sides of a box, as one sees of many: a turned box has the same footprint.
  for (double along = 0.0; along < 1.0; along += 0.01) {
    corner.AddVertex({along, 0.0, 0.0}, Vector3d::UnitZ(), {});
    corner.AddVertex({0.0, along, 0.0}, Vector3d::UnitZ(), {});
  }
  EXPECT_EQ(LeastFootprintYaw(corner.block().positions_map), 0.0);
  EXPECT_EQ(LeastFootprintYaw({}), 0.0);
}

TEST(UprightBox, FindsAnyTurnOfABox) {
  for (int degrees = -40; degrees <= 40; degrees += 5) {
    if (degrees == 0) continue;
    SCOPED_TRACE(degrees);
    TestMesh mesh;
    mesh.AddBox({3.0, 4.0, 0.0}, {2.0, 0.6, 0.5}, {}, 0.05, degrees * M_PI / 180.0);
    const double yaw_rad = LeastFootprintYaw(mesh.block().positions_map);
    EXPECT_NEAR(yaw_rad, degrees * M_PI / 180.0, 0.03);
    const UprightBox box = FitUprightBox(Weighted(mesh.block().positions_map), yaw_rad);
    EXPECT_LT((box.size - Vector3d(2.0, 0.6, 0.5)).cwiseAbs().maxCoeff(), 0.08);
  }
}

TEST(UprightBox, IsNotWidenedByAFewWrongPoints) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, {}, 0.05);
  const size_t count = mesh.block().positions_map.size();
  for (size_t i = 0; i < count / 150; ++i) {
    mesh.AddVertex({5.0, 0.5, 0.5}, Vector3d::UnitZ(), {});
  }
  const UprightBox box = FitUprightBox(Weighted(mesh.block().positions_map), 0.0);
  EXPECT_LT((box.map_T_box.position - Vector3d::Constant(0.5)).norm(), 0.06);
}

TEST(FloorLevels, FindTheFloorOfEachStoreyButNoTableTops) {
  TestMesh mesh;
  mesh.AddFloor(3.0, 0.02);
  mesh.AddFloor(2.0, 3.02);
  mesh.AddBox({0.0, 0.0, 0.0}, {3.0, 3.0, 0.75}, {kTable, 1});
  const std::vector<int32_t> classes{kTable};
  const auto levels = FindFloorLevels({&mesh.block(), nullptr}, classes);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_NEAR(levels[0], 0.02, 1e-3);
  EXPECT_NEAR(levels[1], 3.02, 1e-3);
  EXPECT_EQ(FloorBelow(levels, 0.0), levels[0]);
  EXPECT_EQ(FloorBelow(levels, 2.7), levels[0]);
  EXPECT_EQ(FloorBelow(levels, 2.95), levels[1]);
  EXPECT_EQ(FloorBelow(levels, -1.0), std::nullopt);
  EXPECT_TRUE(FindFloorLevels({}, classes).empty());
}

}  // namespace
}  // namespace dsg::ingest
