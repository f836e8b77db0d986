// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/mesh_join.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/random.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

using test::SmallMaps;

constexpr float kStep = 0.05f;

// A level grid of triangles over [x0, x1] x [0, 2] at the height z, seen from above or below.
MeshBlock Floor(float x0, float x1, float z, double noise_m, uint64_t seed, bool is_up = true) {
  Random random(seed, 3);
  MeshBlock mesh;
  const int columns = static_cast<int>(std::lround((x1 - x0) / kStep)) + 1;
  const int rows = 41;
  for (int i = 0; i < columns; ++i) {
    for (int k = 0; k < rows; ++k) {
      const float up = static_cast<float>(noise_m * random.Normal());
      mesh.positions_map.emplace_back(x0 + kStep * static_cast<float>(i),
                                      kStep * static_cast<float>(k), z + up);
      mesh.normals_map.emplace_back(0.0f, 0.0f, is_up ? 1.0f : -1.0f);
      mesh.labels.push_back(2);
      mesh.instance_ids.push_back(4);
      mesh.last_seen_ns.push_back(50);
    }
  }
  for (int i = 0; i + 1 < columns; ++i) {
    for (int k = 0; k + 1 < rows; ++k) {
      const uint32_t a = static_cast<uint32_t>(i * rows + k);
      const uint32_t b = a + static_cast<uint32_t>(rows);
      mesh.faces.push_back({a, b, a + 1});
      mesh.faces.push_back({b, b + 1, a + 1});
    }
  }
  return mesh;
}

GraphDelta MeshDelta(const MeshBlock& mesh) {
  GraphDelta delta;
  delta.mesh_blocks = SplitIntoBlocks(mesh, 2.0);
  return delta;
}

double Area(const Snapshot& map) {
  double area = 0.0;
  const std::vector<BlockIndex> indices = *map.MeshBlocks();
  for (const BlockIndex index : indices) {
    const MeshBlock block = *map.ReadMeshBlock(index);
    for (const auto& [a, b, c] : block.faces) {
      const auto& at = block.positions_map;
      area += 0.5 * static_cast<double>((at[b] - at[a]).cross(at[c] - at[a]).norm());
    }
  }
  return area;
}

TEST(MeshJoin, AddsWhatIsNewAndNoSecondSkin) {
  for (const double noise_m : {0.0, 0.01, 0.02}) {
    SCOPED_TRACE(noise_m);
    SmallMaps maps;
    maps.Commit("a", MeshDelta(Floor(0.0f, 6.0f, 0.0f, noise_m, 1)));
    maps.Commit("b", MeshDelta(Floor(4.0f, 10.0f, 0.03f, noise_m, 2)));
    const double area = Area(*maps.Newest("a"));
    maps.Merge("a", "b");
    // Two metres times four of new floor, and a seam of a fraction.
    EXPECT_NEAR(Area(*maps.Newest("a")) - area, 8.0 * area / 12.0, 0.3 * area / 12.0);
    EXPECT_EQ(maps.Problems("a"), std::vector<std::string>());
  }
}

TEST(MeshJoin, OfTheSameMeshAgainChangesNothing) {
  SmallMaps maps;
  maps.Commit("a", MeshDelta(Floor(0.0f, 6.0f, 0.0f, 0.01, 1)));
  maps.Commit("b", MeshDelta(Floor(4.0f, 10.0f, 0.03f, 0.01, 2)));
  maps.Merge("a", "b");
  const Revision head = maps.Newest("a")->revision();
  maps.Merge("a", "b");
  EXPECT_EQ(maps.Newest("a")->revision(), head);
}

TEST(MeshJoin, KeepsBothSidesOfAThinBoard) {
  SmallMaps maps;
  maps.Commit("a", MeshDelta(Floor(0.0f, 2.0f, 1.0f, 0.0, 1)));
  maps.Commit("b", MeshDelta(Floor(0.0f, 2.0f, 0.97f, 0.0, 2, /*is_up=*/false)));
  const double area = Area(*maps.Newest("a"));
  maps.Merge("a", "b");
  EXPECT_NEAR(Area(*maps.Newest("a")), 2.0 * area, 0.01 * area);
}

TEST(MeshJoin, TurnsTheMeshAndCutsItIntoTheBlocksOfTheMap) {
  SmallMaps maps;
  MapSpec spec;
  spec.name = "a";
  spec.mesh_block_size_m = 1.0;
  ASSERT_TRUE(maps.store()->CreateMap(spec).ok());
  maps.Commit("a", MeshDelta(MeshBlock()));
  maps.Commit("b", MeshDelta(Floor(0.0f, 3.0f, 0.0f, 0.0, 2)));
  const Pose3d turn{{0.3, 0.2, 0.1},
                    Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))};
  maps.Merge("a", "b", turn);
  EXPECT_NEAR(Area(*maps.Newest("a")), Area(*maps.Newest("b")), 1e-3);
  const std::vector<BlockIndex> indices = *maps.Newest("a")->MeshBlocks();
  for (const BlockIndex index : indices) {
    const MeshBlock block = *maps.Newest("a")->ReadMeshBlock(index);
    for (const auto& face : block.faces) {
      EXPECT_EQ(BlockOf(block.positions_map[face[0]], 1.0), index);
    }
  }
}

TEST(MeshJoin, SaysWhenASurfaceWasSeenAgain) {
  SmallMaps maps;
  MeshBlock old_floor = Floor(0.0f, 2.0f, 0.0f, 0.0, 1);
  old_floor.last_seen_ns.assign(old_floor.last_seen_ns.size(), 10);
  maps.Commit("a", MeshDelta(old_floor));
  maps.Commit("b", MeshDelta(Floor(0.0f, 1.0f, 0.02f, 0.0, 2)));
  maps.Merge("a", "b");
  const MeshBlock block = *maps.Newest("a")->ReadMeshBlock({0, 0, 0});
  for (size_t i = 0; i < block.positions_map.size(); ++i) {
    const float x = block.positions_map[i].x();
    // In between, vertices of both maps are near enough to either.
    if (x > 0.94f && x < 1.2f) continue;
    EXPECT_EQ(block.last_seen_ns[i], x < 1.0f ? 50 : 10);
  }
}

}  // namespace
}  // namespace dsg::merge
