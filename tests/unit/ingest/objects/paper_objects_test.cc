// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/paper_objects.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/ingest/objects/objects_test_util.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

TEST(PaperObjects, StandAtTheMeanOfTheirVerticesInABoxAlongTheAxes) {
  TestMesh mesh;
  mesh.AddFloor(1.0, 0.0);
  // A quarter of a right angle: the box of the turned chair is wider than the chair.
  mesh.AddBox({0.0, 0.0, 0.3}, kChairSize, {kChair}, 0.03, M_PI / 4.0);
  const auto found = FindPaperObjects({&mesh.block()}, FiveCentimetres());
  ASSERT_EQ(found.size(), 1u);
  Vector3d sum = Vector3d::Zero();
  for (const Eigen::Vector3f& point : found[0].points_map) sum += point.cast<double>();
  EXPECT_TRUE(found[0].is_at_centroid);
  EXPECT_LT((found[0].centroid_map - sum / found[0].points_map.size()).norm(), 1e-9);
  // No side below: the mean is above the middle.
  EXPECT_GT(found[0].centroid_map.z(), found[0].center_map.z());
  EXPECT_LT(AngleBetween(found[0].map_T_box.orientation, Eigen::Quaterniond::Identity()), 1e-9);
  EXPECT_NEAR(found[0].size.x(), 0.45 * std::sqrt(2.0), 0.01);
  // Nothing is extended down to the floor.
  EXPECT_NEAR(found[0].size.z(), 0.9, 0.01);
}

TEST(PaperObjects, AreOneWhereTwoInstancesAreNearerThanTwoVoxels) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair, 1});
  mesh.AddBox({0.53, 0.0, 0.0}, kChairSize, {kChair, 2});
  mesh.AddBox({1.5, 0.0, 0.0}, kChairSize, {kChair, 3});
  EXPECT_EQ(FindPaperObjects({&mesh.block()}, FiveCentimetres()).size(), 2u);
  EXPECT_EQ(ClustersOf(mesh.block()).size(), 3u);
}

TEST(PaperObjects, AreOfOneClassEach) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair});
  mesh.AddBox({0.46, 0.0, 0.0}, kChairSize, {kTable});
  mesh.AddBox({3.0, 0.0, 0.0}, kChairSize, {kWall});
  const auto found = FindPaperObjects({&mesh.block()}, FiveCentimetres());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].class_id, kChair);
  EXPECT_EQ(found[1].class_id, kTable);
}

TEST(PaperObjects, AreNoneOfBrokenInput) {
  TestMesh mesh;
  mesh.AddBox({0.0, 0.0, 0.0}, kChairSize, {kChair});
  MeshBlock cut = mesh.block();
  cut.labels.pop_back();
  EXPECT_TRUE(FindPaperObjects({&cut, nullptr}, FiveCentimetres()).empty());
  MeshBlock few = mesh.block();
  few.positions_map.resize(3);
  few.labels.resize(3);
  EXPECT_TRUE(FindPaperObjects({&few}, FiveCentimetres()).empty());
  MeshBlock endless = mesh.block();
  for (auto& point : endless.positions_map) point.x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(FindPaperObjects({&endless}, FiveCentimetres()).empty());
  ClusterOptions flat = FiveCentimetres();
  flat.voxel_m = 0.0;
  EXPECT_TRUE(FindPaperObjects({&mesh.block()}, flat).empty());
}

}  // namespace
}  // namespace dsg::ingest
