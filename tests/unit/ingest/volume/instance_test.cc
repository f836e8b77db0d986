// SPDX-License-Identifier: Apache-2.0
// Things keep their instance id while the numbers in the images change from frame to frame.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

constexpr uint16_t kChair = 7 << 8;

// A row of chairs half a metre apart in a room, and a table.
TestScene RowOfChairs() {
  TestScene scene{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5})}};
  scene.shapes[0].label = 1 << 8;
  for (int i = 0; i < 4; ++i) {
    const double y = -1.8 + i;
    scene.shapes.push_back(SolidBox({0.5, y, -1.6}, {1.0, y + 0.5, -0.6}));
  }
  scene.shapes.push_back(SolidBox({-1.5, 2.0, -1.6}, {0.0, 2.8, -0.8}));
  return scene;
}

// The instance that most vertices near a shape's surface have, per class.
std::map<uint32_t, size_t> InstancesOn(const CollectedMesh& mesh, const TestShape& shape) {
  std::map<uint32_t, size_t> counts;
  for (const MeshBlock& block : mesh.blocks()) {
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3d p = block.positions_map[i].cast<double>();
      if (p.z() > -1.3 && std::abs(shape.distance(p)) < 0.05) ++counts[block.instance_ids[i]];
    }
  }
  return counts;
}

uint32_t LeaderOf(const std::map<uint32_t, size_t>& counts) {
  uint32_t best = 0;
  size_t most = 0;
  size_t total = 0;
  for (const auto& [id, count] : counts) {
    total += count;
    if (count > most) {
      best = id;
      most = count;
    }
  }
  // At outlines nothing is believed.
  EXPECT_GT(most, total * 6 / 10);
  EXPECT_GT(most, (total - (counts.count(0) > 0 ? counts.at(0) : 0)) * 9 / 10);
  return best;
}

void Renumber(int round, TestScene* scene) {
  for (size_t i = 1; i <= 4; ++i) {
    scene->shapes[i].label =
        static_cast<uint16_t>(kChair | (1 + (i * 3 + static_cast<size_t>(round) * 5) % 7));
  }
  scene->shapes[5].label = static_cast<uint16_t>(8 << 8 | (1 + round % 3));
}

DepthFrame LookFrom(const TestScene& scene, int i) {
  const double angle = i * M_PI / 10.0;
  return scene.Render(
      SmallCamera(), LookAt({2.3 * std::cos(angle), 2.3 * std::sin(angle), 0.6}, {0.3, 0.3, -0.8}));
}

TEST(Instance, ChairsKeepTheirIdsWhileTheImagesRenumberThem) {
  TestScene scene = RowOfChairs();
  SemanticVolume volume((VolumeOptions()));
  CollectedMesh mesh;
  std::vector<uint32_t> early;
  for (int i = 0; i < 20; ++i) {
    Renumber(i, &scene);
    ASSERT_TRUE(volume.Integrate(LookFrom(scene, i)).ok());
    if (i != 9) continue;
    mesh.Take(&volume);
    for (size_t k = 1; k <= 5; ++k) early.push_back(LeaderOf(InstancesOn(mesh, scene.shapes[k])));
  }
  mesh.Take(&volume);
  std::set<uint32_t> ids;
  for (size_t k = 1; k <= 5; ++k) {
    const uint32_t id = LeaderOf(InstancesOn(mesh, scene.shapes[k]));
    EXPECT_NE(id, 0u);
    EXPECT_EQ(id, early[k - 1]) << "shape " << k;
    ids.insert(id);
  }
  EXPECT_EQ(ids.size(), 5u) << "five things, five ids";
}

TEST(Instance, TwoHalvesBecomeOneWhenASegmentKeepsCoveringBoth) {
  TestScene scene{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5}),
                   SolidBox({1.0, -1.0, -1.6}, {1.6, 0.0, -0.3}),
                   SolidBox({1.0, 0.0, -1.6}, {1.6, 1.0, -0.3})}};
  scene.shapes[1].label = kChair | 1;
  scene.shapes[2].label = kChair | 2;
  SemanticVolume volume((VolumeOptions()));
  const Pose3d pose = LookAt({-1.5, 0.0, 0.5}, {1.5, 0.0, -0.5});
  const auto look = [&](int rounds) {
    for (int i = 0; i < rounds; ++i) {
      ASSERT_TRUE(volume.Integrate(scene.Render(SmallCamera(), pose)).ok());
    }
  };
  look(8);
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_NE(LeaderOf(InstancesOn(mesh, scene.shapes[1])),
            LeaderOf(InstancesOn(mesh, scene.shapes[2])));
  scene.shapes[2].label = kChair | 1;
  look(8);
  mesh.Take(&volume);
  EXPECT_EQ(LeaderOf(InstancesOn(mesh, scene.shapes[1])),
            LeaderOf(InstancesOn(mesh, scene.shapes[2])));
}

TEST(Instance, ClassesWithoutInstancesAndInstancesWithoutClassGetNone) {
  TestScene scene{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5}), Ball({1.0, 0.0, 0.0}, 0.6)}};
  scene.shapes[0].label = 1 << 8;
  scene.shapes[1].label = 5;
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(
        volume.Integrate(scene.Render(SmallCamera(), LookAt({-2.0, 0.0, 0.0}, {1.0, 0.0, 0.0})))
            .ok());
  }
  size_t wall_count = 0;
  for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
    for (size_t i = 0; i < block.labels.size(); ++i) {
      EXPECT_EQ(block.instance_ids[i], 0u);
      EXPECT_LE(block.labels[i], 1u);
      wall_count += block.labels[i];
    }
  }
  EXPECT_GT(wall_count, 500u);
}

}  // namespace
}  // namespace dsg::ingest
