// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_cluster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <iostream>
#include <limits>

#include "schema/base/random.h"
#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

// The steps of the test meshes and the mean of a voxel move a centre by less than this.
constexpr double kExactM = 0.02;

TEST(FindClusters, PutsThePositionIntoTheMiddleOfTheBoxAndNotOfTheVisibleSide) {
  TestMesh mesh;
  mesh.AddFloor(2.0, 0.0);
  // The front and the front half of the top have ten times the vertices of the other sides.
  mesh.AddBox({0.0, 0.0, 0.0}, {1.9, 0.85, 0.8}, {kCouch, 5}, 0.05);
  mesh.AddBox({0.0, 0.0, 0.0}, {1.9, 0.1, 0.8}, {kCouch, 5}, 0.01);
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_EQ(clusters[0].class_id, kCouch);
  EXPECT_EQ(clusters[0].instance_id, 5u);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.95, 0.425, 0.4)).norm(), kExactM);
  EXPECT_LT((clusters[0].size - Vector3d(1.9, 0.85, 0.8)).cwiseAbs().maxCoeff(), 2.0 * kExactM);
  EXPECT_EQ(clusters[0].color, (Color{0x80, 0x80, 0x80, 255}));
}

TEST(FindClusters, SplitsTwoChairsThatTouch) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  mesh.AddBox({0.46, 0.0, 0.0}, kChairSize, {kChair, 2});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 2u);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.225, 0.225, 0.45)).norm(), kExactM);
  EXPECT_LT((clusters[1].center_map - Vector3d(0.685, 0.225, 0.45)).norm(), kExactM);
  EXPECT_EQ(clusters[0].instance_id, 1u);
  EXPECT_EQ(clusters[1].instance_id, 2u);
}

TEST(FindClusters, SplitsARowOfSixChairsOfWhichEachIsASmallShare) {
  TestMesh mesh;
  for (uint32_t i = 0; i < 6; ++i) {
    mesh.AddBox({0.46 * i, 0.0, 0.0}, kChairSize, {kChair, i + 1});
  }
  EXPECT_EQ(ClustersOf(mesh.block()).size(), 6u);
}

TEST(FindClusters, LeavesTouchingChairsTogetherWhenNothingTellsThemApart) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 0});
  mesh.AddBox({0.46, 0.0, 0.0}, kChairSize, {kChair, 0});
  EXPECT_EQ(ClustersOf(mesh.block()).size(), 1u);
}

TEST(FindClusters, GivesVerticesWithoutInstanceToTheNearestPartOfASplit) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  mesh.AddBox({0.46, 0.0, 0.0}, kChairSize, {kChair, 2});
  for (size_t i = 0; i < mesh.block().instance_ids.size(); i += 3) {
    mesh.block().instance_ids[i] = 0;
  }
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 2u);
  for (const ObjectCluster& cluster : clusters) EXPECT_LT(cluster.size.x(), 0.52);
}

TEST(FindClusters, KeepsAnObjectWholeWhoseTwoInstancesAreInterwoven) {
  const uint64_t seed = 1;
  SCOPED_TRACE(seed);
  Random random(seed, 0);
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {1.9, 0.85, 0.8}, {kCouch, 1});
  for (uint32_t& instance : mesh.block().instance_ids) {
    if (random.Chance(0.45)) instance = 2;
  }
  EXPECT_EQ(ClustersOf(mesh.block()).size(), 1u);
}

TEST(FindClusters, JoinsACouchThatAPillarCutsInTwo) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {0.8, 0.85, 0.8}, {kCouch, 3});
  mesh.AddBox({1.1, 0.0, 0.0}, {0.8, 0.85, 0.8}, {kCouch, 3});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.95, 0.425, 0.4)).norm(), kExactM);
}

TEST(FindClusters, DoesNotJoinAcrossARoomThoughTheInstanceSaysSo) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {0.8, 0.85, 0.8}, {kCouch, 3});
  mesh.AddBox({3.0, 0.0, 0.0}, {0.8, 0.85, 0.8}, {kCouch, 3});
  EXPECT_EQ(ClustersOf(mesh.block()).size(), 2u);
}

TEST(FindClusters, CorrectsLabelsByTheMajorityOfTheirInstance) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {1.9, 0.85, 0.8}, {kCouch, 3});
  // A quarter of the couch looks like a chair to the camera, and some of it like nothing at all.
  for (size_t i = 0; i < mesh.block().labels.size(); ++i) {
    if (mesh.block().positions_map[i].x() < 0.5f) mesh.block().labels[i] = i % 2 == 0 ? kChair : 0;
  }
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_EQ(clusters[0].class_id, kCouch);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.95, 0.425, 0.4)).norm(), kExactM);
}

TEST(FindClusters, IgnoresTheInstancesOfWalls) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {4.0, 0.1, 2.5}, {kWall, 9});
  mesh.AddBox({1.0, 0.15, 0.0}, kChairSize, {kChair, 9});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_EQ(clusters[0].class_id, kChair);
  EXPECT_EQ(clusters[0].instance_id, 0u);
}

TEST(FindClusters, IsNotWidenedByLabelsThatBledOntoTheFloor) {
  TestMesh mesh;
  mesh.AddFloor(2.0, 0.0);
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  for (size_t i = 0; i < mesh.block().labels.size(); ++i) {
    const Eigen::Vector3f& point = mesh.block().positions_map[i];
    // A shadow on one side.
    if (mesh.block().labels[i] == kFloor && point.x() > 0.45f && point.x() < 0.7f &&
        point.y() > 0.0f && point.y() < 0.45f) {
      mesh.block().labels[i] = kChair;
      mesh.block().instance_ids[i] = 1;
    }
  }
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.225, 0.225, 0.45)).norm(), 2.0 * kExactM);
}

TEST(FindClusters, DropsTheOutlineOfAChairOnTheWallBehindIt) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  for (double z = 0.5; z < 0.9; z += 0.02) {
    mesh.AddVertex({0.2, 1.5, z}, -Vector3d::UnitY(), {kChair, 1});
  }
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.225, 0.225, 0.45)).norm(), kExactM);
}

TEST(FindClusters, DropsSpecks) {
  TestMesh mesh;
  mesh.AddBox({0.01, 0.01, 0.01}, {0.06, 0.03, 0.06}, {kChair, 0}, 0.02);
  EXPECT_TRUE(ClustersOf(mesh.block()).empty());
}

TEST(FindClusters, FindsASmallCupOnATable) {
  TestMesh mesh;
  mesh.AddFloor(2.0, 0.0);
  mesh.AddBox({0.0, 0.0, 0.0}, {1.4, 0.8, 0.75}, {kTable, 1});
  mesh.AddBox({0.61, 0.41, 0.75}, {0.08, 0.08, 0.1}, {kCup, 2});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 2u);
  EXPECT_EQ(clusters[1].class_id, kCup);
  EXPECT_LT((clusters[1].center_map - Vector3d(0.65, 0.45, 0.8)).norm(), 0.02);
}

TEST(FindClusters, StandsATableTopWithoutLegsOnTheFloor) {
  TestMesh mesh;
  mesh.AddFloor(2.0, -0.5);
  mesh.AddBox({0.0, 0.0, 0.2}, {1.4, 0.8, 0.05}, {kTable, 1});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_NEAR(clusters[0].size.z(), 0.75, 0.03);
  EXPECT_NEAR(clusters[0].center_map.z(), -0.125, 0.02);
}

TEST(FindClusters, LeavesAWorktopOnTheCabinetThatCarriesIt) {
  TestMesh mesh;
  mesh.AddFloor(2.0, 0.0);
  mesh.AddBox({0.0, 0.0, 0.0}, {1.4, 0.8, 0.85}, {kShelf, 1});
  mesh.AddBox({0.0, 0.0, 0.87}, {1.4, 0.8, 0.04}, {kTable, 2});
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 2u);
  EXPECT_EQ(clusters[0].class_id, kTable);
  EXPECT_LT(clusters[0].size.z(), 0.1);
}

TEST(FindClusters, TakesTheGivenFloor) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.2}, {0.4, 0.4, 0.5}, {kChair, 1});
  ClusterOptions options = FiveCentimetres();
  EXPECT_NEAR(ClustersOf(mesh.block(), options)[0].size.z(), 0.5, 0.02);
  options.floor_z_m = 0.0;
  EXPECT_NEAR(ClustersOf(mesh.block(), options)[0].size.z(), 0.7, 0.02);
}

TEST(FindClusters, TurnsTheBoxOfATurnedTable) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, {1.8, 0.7, 0.75}, {kTable, 1}, 0.03, M_PI / 6.0);
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  const Vector3d x = clusters[0].map_T_box.orientation * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(x.y(), x.x()), M_PI / 6.0, 0.03);
  EXPECT_LT((clusters[0].size - Vector3d(1.8, 0.7, 0.75)).cwiseAbs().maxCoeff(), 0.06);
  EXPECT_LT((clusters[0].center_map - Vector3d(0.9, 0.35, 0.375)).norm(), kExactM);
}

TEST(FindClusters, SurvivesMeshesThatMakeNoSense) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  mesh.AddVertex({1e30, 0.0, 0.0}, Vector3d::UnitZ(), {kChair, 1});
  mesh.block().positions_map.back().y() = nan;
  mesh.AddVertex({1e30, 0.0, 0.0}, Vector3d::UnitZ(), {kChair, 1});
  MeshBlock no_labels = mesh.block();
  no_labels.labels.pop_back();
  MeshBlock positions_only;
  positions_only.positions_map = mesh.block().positions_map;
  const MeshBlock empty;
  EXPECT_EQ(
      FindClusters({&mesh.block(), &no_labels, &positions_only, &empty, nullptr}, FiveCentimetres())
          .size(),
      1u);
  ClusterOptions options = FiveCentimetres();
  options.voxel_m = 0.0;
  EXPECT_TRUE(FindClusters({&mesh.block()}, options).empty());
  options.voxel_m = static_cast<double>(nan);
  EXPECT_TRUE(FindClusters({&mesh.block()}, options).empty());
  EXPECT_TRUE(FindClusters({&mesh.block()}, ClusterOptions()).empty());
  EXPECT_TRUE(FindClusters({}, FiveCentimetres()).empty());
}

TEST(FindClusters, WorksWithoutNormalsColorsAndInstances) {
  TestMesh mesh;
  mesh.AddFloor(2.0, 0.0);
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  mesh.block().normals_map.clear();
  mesh.block().colors.clear();
  mesh.block().instance_ids.clear();
  const auto clusters = ClustersOf(mesh.block());
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_EQ(clusters[0].color, Color{});
  EXPECT_LT((clusters[0].center_map - Vector3d(0.225, 0.225, 0.45)).norm(), kExactM);
}

// A room of things in random places, with noise.
MeshBlock RandomRoom(uint64_t seed, int object_count) {
  Random random(seed, 0);
  TestMesh mesh;
  mesh.AddFloor(5.0, 0.0);
  const uint32_t labels[] = {kChair, kTable, kCouch, kShelf};
  for (int i = 0; i < object_count; ++i) {
    const Vector3d low(random.Uniform(-5.0, 4.0), random.Uniform(-5.0, 4.0), 0.0);
    const Vector3d size(random.Uniform(0.3, 1.5), random.Uniform(0.3, 1.5),
                        random.Uniform(0.3, 1.5));
    mesh.AddBox(low, size, {labels[random.Index(4)], static_cast<uint32_t>(1 + random.Index(30))});
  }
  for (Eigen::Vector3f& point : mesh.block().positions_map) {
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] += static_cast<float>(0.005 * random.Normal());
    }
  }
  return mesh.block();
}

void ExpectEqual(const std::vector<ObjectCluster>& a, const std::vector<ObjectCluster>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].class_id, b[i].class_id);
    EXPECT_EQ(a[i].instance_id, b[i].instance_id);
    EXPECT_EQ(a[i].points_map, b[i].points_map);
    EXPECT_EQ(a[i].center_map, b[i].center_map);
    EXPECT_EQ(a[i].centroid_map, b[i].centroid_map);
    EXPECT_EQ(a[i].size, b[i].size);
    EXPECT_EQ(a[i].color, b[i].color);
  }
}

TEST(FindClusters, DoesNotDependOnTheOrderOfBlocks) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<MeshBlock> blocks = SplitIntoBlocks(RandomRoom(seed, 20), 0.8);
    std::vector<const MeshBlock*> pointers;
    for (const MeshBlock& block : blocks) pointers.push_back(&block);
    const auto first = FindClusters(pointers, FiveCentimetres());
    EXPECT_GT(first.size(), 5u);
    ExpectEqual(first, FindClusters(pointers, FiveCentimetres()));
    std::reverse(pointers.begin(), pointers.end());
    ExpectEqual(first, FindClusters(pointers, FiveCentimetres()));
  }
}

TEST(FindClusters, IsQuickForTensOfThousandsOfVertices) {
  const MeshBlock mesh = RandomRoom(1, 60);
  ASSERT_GT(mesh.labels.size(), 100000u);
  // Of the processor, so that a busy machine does not matter.
  const std::clock_t begin = std::clock();
  EXPECT_FALSE(ClustersOf(mesh).empty());
  const double passed_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::cout << mesh.labels.size() << " vertices in " << passed_s << " s\n";
  // A tenth of this; the bound only catches what grows with the square of the vertices.
  EXPECT_LT(passed_s, 4.0);
}

}  // namespace
}  // namespace dsg::ingest
