// SPDX-License-Identifier: Apache-2.0
// Blocks of mesh fit together without cracks, carry what was seen, and rest once it is known.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "schema/base/random.h"
#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

TestScene Furnished() {
  TestScene scene{{RoomOf({-3, -3, -1.53}, {3, 3, 1.5}), Ball({0.33, 0.24, 0.12}, 0.7),
                   SolidBox({1.2, -1.9, -1.6}, {2.15, -1.1, -0.6})}};
  scene.shapes[0].label = 1 << 8;
  scene.shapes[0].rgb = {10, 200, 30};
  scene.shapes[1].label = 2 << 8 | 1;
  scene.shapes[1].rgb = {250, 20, 40};
  scene.shapes[2].label = 3 << 8 | 1;
  return scene;
}

DepthFrame Look(const TestScene& scene, int i, double height = 0.3) {
  const double angle = i * M_PI / 8.0;
  const Eigen::Vector3d eye(2.2 * std::cos(angle), 2.2 * std::sin(angle), height);
  const Eigen::Vector3d target = i % 2 == 0 ? Eigen::Vector3d(0, 0, -0.3) : Eigen::Vector3d(-eye);
  return scene.Render(SmallCamera(), LookAt(eye, target));
}

using Point = std::tuple<float, float, float>;

Point KeyOf(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

// An edge is open when it has one face. The surface may end where nothing was seen beyond, so only
// the ball, which was seen from all around, must be closed.
TEST(VolumeMesh, HasNoCracksNotEvenBetweenBlocks) {
  const TestScene scene = Furnished();
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 16; ++i) {
    ASSERT_TRUE(volume.Integrate(Look(scene, 2 * i, 1.2)).ok());
    ASSERT_TRUE(volume.Integrate(Look(scene, 2 * i, -0.9)).ok());
  }
  for (const double height : {-1.4, 1.4}) {
    const Pose3d pose = LookAt({0.4, 0.3, height}, {0.33, 0.24, 0.12});
    ASSERT_TRUE(volume.Integrate(scene.Render(SmallCamera(), pose)).ok());
  }
  CollectedMesh mesh;
  mesh.Take(&volume, 0.5);
  EXPECT_GT(mesh.blocks().size(), 30u);
  std::map<std::pair<Point, Point>, int> uses;
  for (const MeshBlock& block : mesh.blocks()) {
    for (const auto& face : block.faces) {
      EXPECT_EQ(BlockOf(block.positions_map[face[0]], 0.5), block.index);
      for (size_t i = 0; i < 3; ++i) {
        ++uses[{KeyOf(block.positions_map[face[i]]),
                KeyOf(block.positions_map[face[(i + 1) % 3]])}];
      }
    }
  }
  size_t ball_edges = 0;
  size_t open_edges = 0;
  for (const auto& [edge, count] : uses) {
    ASSERT_EQ(count, 1) << "one face per side of an edge";
    const auto& [x, y, z] = edge.first;
    if ((Eigen::Vector3f(x, y, z) - Eigen::Vector3f(0.33f, 0.24f, 0.12f)).norm() > 0.8f) continue;
    ++ball_edges;
    open_edges += uses.count({edge.second, edge.first}) == 0 ? 1 : 0;
  }
  EXPECT_EQ(open_edges, 0u);
  EXPECT_GT(ball_edges, 2000u);
}

TEST(VolumeMesh, SharesVerticesWithinABlock) {
  const TestScene scene = Furnished();
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(volume.Integrate(Look(scene, i)).ok());
  for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
    std::set<Point> seen;
    for (const Eigen::Vector3f& p : block.positions_map) EXPECT_TRUE(seen.insert(KeyOf(p)).second);
    EXPECT_EQ(block.normals_map.size(), block.positions_map.size());
    EXPECT_EQ(block.colors.size(), block.positions_map.size());
    EXPECT_EQ(block.labels.size(), block.positions_map.size());
    EXPECT_EQ(block.instance_ids.size(), block.positions_map.size());
  }
}

TEST(VolumeMesh, CarriesColourAndClassOfWhatWasSeen) {
  const TestScene scene = Furnished();
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 16; ++i) ASSERT_TRUE(volume.Integrate(Look(scene, i)).ok());
  size_t right = 0;
  size_t colored = 0;
  size_t count = 0;
  for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3d p = block.positions_map[i].cast<double>();
      const bool is_ball = std::abs(scene.shapes[1].distance(p)) < 0.05;
      const bool is_wall = std::abs(scene.shapes[0].distance(p)) < 0.05;
      if (is_ball == is_wall) continue;
      ++count;
      right += block.labels[i] == (is_ball ? 2u : 1u) ? 1 : 0;
      const auto& rgb = scene.shapes[is_ball ? 1 : 0].rgb;
      const uint32_t color = static_cast<uint32_t>(rgb[0] << 16 | rgb[1] << 8 | rgb[2]);
      colored += block.colors[i] == color ? 1 : 0;
    }
  }
  EXPECT_GT(count, 3000u);
  EXPECT_GT(right, count * 98 / 100);
  EXPECT_GT(colored, count * 95 / 100);
}

TEST(VolumeMesh, ComesToRestWhileLooksRepeat) {
  const TestScene scene = Furnished();
  VolumeOptions options;
  options.voxel_m = 0.1;
  SemanticVolume volume(options);
  constexpr uint64_t kSeed = 4;
  SCOPED_TRACE(kSeed);
  Random random(kSeed, 0);
  const auto look_noisily = [&](int rounds) {
    for (int i = 0; i < rounds; ++i) {
      DepthFrame frame = Look(scene, 0);
      for (float& depth : frame.depth_m) depth += static_cast<float>(0.004 * random.Normal());
      ASSERT_TRUE(volume.Integrate(frame).ok());
    }
  };
  look_noisily(30);
  const size_t first = volume.TakeChangedMesh(2.0).size();
  EXPECT_GT(first, 3u);
  look_noisily(5);
  volume.TakeChangedMesh(2.0);
  look_noisily(5);
  EXPECT_LE(volume.TakeChangedMesh(2.0).size(), first / 4);
  EXPECT_TRUE(volume.TakeChangedMesh(2.0).empty()) << "nothing has been integrated since";
}

TEST(VolumeMesh, InPiecesEqualsTheMeshAtTheEnd) {
  const TestScene scene = Furnished();
  VolumeOptions options;
  SemanticVolume volume(options);
  CollectedMesh pieces;
  for (int i = 0; i < 16; ++i) {
    ASSERT_TRUE(volume.Integrate(Look(scene, i)).ok());
    pieces.Take(&volume);
  }
  SemanticVolume whole(options);
  for (int i = 0; i < 16; ++i) ASSERT_TRUE(whole.Integrate(Look(scene, i)).ok());
  CollectedMesh end;
  end.Take(&whole);
  // They may differ by what has not been worth a new revision.
  EXPECT_NEAR(static_cast<double>(pieces.face_count()), static_cast<double>(end.face_count()),
              0.02 * static_cast<double>(end.face_count()));
  EXPECT_NEAR(pieces.RmsError(scene), end.RmsError(scene), 0.003);
}

TEST(VolumeMesh, ALabelChangesAfterFiveContradictingLooks) {
  TestScene scene = Furnished();
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(volume.Integrate(Look(scene, 0)).ok());
  CollectedMesh mesh;
  mesh.Take(&volume);
  scene.shapes[0].label = 9 << 8;
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(volume.Integrate(Look(scene, 0)).ok());
  mesh.Take(&volume);
  size_t old_count = 0;
  size_t new_count = 0;
  for (const MeshBlock& block : mesh.blocks()) {
    for (const uint32_t label : block.labels) {
      old_count += label == 1 ? 1 : 0;
      new_count += label == 9 ? 1 : 0;
    }
  }
  EXPECT_EQ(old_count, 0u);
  EXPECT_GT(new_count, 500u);
}

TEST(VolumeMesh, DropsSpecksOfNoise) {
  SemanticVolume volume((VolumeOptions()));
  const TestScene room{{RoomOf({-3, -3, -1.53}, {3, 3, 1.5})}};
  const Pose3d pose = LookAt({-2.5, 0.0, 0.0}, {2.0, 0.0, 0.0});
  DepthFrame frame = room.Render(SmallCamera(), pose);
  // One pixel floats in the middle of the room.
  frame.depth_m[60 * 160 + 80] = 2.0f;
  ASSERT_TRUE(volume.Integrate(frame).ok());
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(mesh.face_count(), 1000u);
  EXPECT_EQ(mesh.CountNear({-0.5, 0.0, 0.0}, 0.4), 0u);
}

}  // namespace
}  // namespace dsg::ingest
