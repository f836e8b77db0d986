// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/scene.h"

#include <gtest/gtest.h>

#include <set>

#include "ingest/simulator/scene/shapes.h"

namespace dsg::simulator {
namespace {

class SceneOfWorld : public testing::TestWithParam<WorldKind> {
 protected:
  void SetUp() override {
    auto world = GenerateWorld({GetParam(), 3});
    ASSERT_TRUE(world.ok()) << world.status();
    world_ = *std::move(world);
    scene_ = BuildScene(world_, {});
  }

  World world_;
  Scene scene_;
};

INSTANTIATE_TEST_SUITE_P(Worlds, SceneOfWorld,
                         testing::Values(WorldKind::kApartment, WorldKind::kWing,
                                         WorldKind::kOffice));

TEST_P(SceneOfWorld, HasTrianglesOfModestSizeAndNumber) {
  EXPECT_GT(scene_.FaceCount(), 10000);
  EXPECT_LT(scene_.FaceCount(), 1500000);
  int long_edges = 0;
  for (const Part& part : scene_.parts) {
    for (const auto& face : part.mesh.faces) {
      for (int i = 0; i < 3; ++i) {
        ASSERT_LT(face[i], part.mesh.vertices.size());
        const float length =
            (part.mesh.vertices[face[i]] - part.mesh.vertices[face[(i + 1) % 3]]).norm();
        long_edges += length > 1.001f ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(long_edges, 0);
}

TEST_P(SceneOfWorld, StaysWithinTheBuilding) {
  const Rect bounds = Inflate(world_.Bounds(), 1e-3);
  for (const Part& part : scene_.parts) {
    const Eigen::AlignedBox3f box = BoundsOf(part.mesh);
    EXPECT_TRUE(bounds.contains(Point(box.min().head<2>().cast<double>())));
    EXPECT_TRUE(bounds.contains(Point(box.max().head<2>().cast<double>())));
    EXPECT_GE(box.min().z(), -1e-3f);
    EXPECT_LE(box.max().z(), static_cast<float>(world_.plan.ceiling_m) + 1e-3f);
  }
}

TEST_P(SceneOfWorld, HasSomeBlankWallsAndLightInEveryRoom) {
  int walls = 0;
  for (const Structure& structure : world_.plan.structures) {
    walls += structure.type == "wall" && structure.z_min_m == 0.0 ? 1 : 0;
  }
  int blank = 0;
  for (const Part& part : scene_.parts) blank += part.material == Material::kBlank ? 1 : 0;
  EXPECT_GE(blank, walls * 0.05);
  EXPECT_LE(blank, walls * 0.1);
  ASSERT_EQ(scene_.lights.size(), world_.plan.rooms.size());
  int dark = 0;
  for (const RoomLight& light : scene_.lights) {
    EXPECT_FALSE(light.lamps_map.empty());
    dark += light.ambient < 0.2f ? 1 : 0;
  }
  EXPECT_EQ(dark, GetParam() == WorldKind::kOffice ? 1 : 0);
}

TEST_P(SceneOfWorld, DrawsEveryPieceOfFurnitureWhereItStands) {
  const std::vector<int> instances = FurnitureInstances(world_);
  ASSERT_EQ(instances.size(), world_.furniture.size());
  for (size_t i = 0; i < instances.size(); ++i) {
    const Furniture& item = world_.furniture[i];
    Eigen::AlignedBox3f drawn;
    for (const Part& part : scene_.parts) {
      if (part.class_id != ClassId(item.class_name) || part.instance != instances[i]) continue;
      // Instances may repeat in large worlds; those of one room never do.
      if (part.room == item.room) drawn.extend(BoundsOf(part.mesh));
    }
    const Rect footprint = item.Footprint();
    EXPECT_NEAR(drawn.min().x(), footprint.min().x(), 1e-4) << item.name;
    EXPECT_NEAR(drawn.max().y(), footprint.max().y(), 1e-4) << item.name;
    EXPECT_NEAR(drawn.max().z(), item.center.z() + 0.5 * item.size.z(), 1e-4) << item.name;
  }
}

TEST_P(SceneOfWorld, LeavesOutWhatIsMovable) {
  const Scene without = BuildScene(world_, {0, 2});
  size_t part_count = 0;
  for (const int index : {0, 2}) {
    const Furniture& item = world_.furniture[index];
    part_count += FurnitureParts(item.class_name, item.size, item.color).size();
  }
  EXPECT_EQ(scene_.parts.size() - part_count, without.parts.size());
}

TEST_P(SceneOfWorld, CountsInstancesFromOneWithinTheirClass) {
  const std::vector<int> instances = FurnitureInstances(world_);
  std::set<std::pair<std::string, int>> seen;
  for (size_t i = 0; i < instances.size(); ++i) {
    EXPECT_GE(instances[i], 1);
    EXPECT_LE(instances[i], 255);
    if (GetParam() != WorldKind::kOffice) {
      EXPECT_TRUE(seen.emplace(world_.furniture[i].class_name, instances[i]).second);
    }
  }
}

}  // namespace
}  // namespace dsg::simulator
