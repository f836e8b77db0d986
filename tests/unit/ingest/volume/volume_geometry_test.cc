// SPDX-License-Identifier: Apache-2.0
// Distances and meshes agree with scenes whose distance is known, from one side or from two.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "ingest/volume/block_integrator.h"
#include "ingest/volume/block_search.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

constexpr double kVoxelM = 0.1;

void Integrate(const TestScene& scene, const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
               SemanticVolume* volume) {
  const DepthFrame frame = scene.Render(SmallCamera(), LookAt(eye, target));
  ASSERT_TRUE(volume->Integrate(frame).ok());
}

TestScene BallInRoom() {
  return {{RoomOf({-3, -3, -1.5}, {3, 3, 1.5}), Ball({0.03, 0.04, 0.02}, 0.7)}};
}

TestScene BoxInRoom() {
  return {
      {RoomOf({-3, -3, -1.53}, {3, 3, 1.5}), SolidBox({-0.52, -0.48, -1.6}, {0.47, 0.55, 0.13})}};
}

void WalkAround(const TestScene& scene, SemanticVolume* volume) {
  for (int i = 0; i < 16; ++i) {
    const double angle = i * M_PI / 8.0;
    const Eigen::Vector3d eye(2.2 * std::cos(angle), 2.2 * std::sin(angle), 0.5);
    Integrate(scene, eye, {0.0, 0.0, 0.0}, volume);
    Integrate(scene, eye, {2.0 * eye.x(), 2.0 * eye.y(), -0.5}, volume);
  }
}

// Voxel by voxel, on the blocks themselves. Further behind, at the edges of a room, the distance to
// a wall's plane is not the one to its edge.
double MeanBandError(const TestScene& scene, const std::vector<DepthFrame>& frames) {
  VolumeOptions options;
  options.voxel_m = kVoxelM;
  std::map<BlockKey, VoxelBlock> blocks;
  for (const DepthFrame& frame : frames) {
    const FrameView view(frame, options);
    const BlockIntegrator integrator(view, options, {});
    for (const BlockKey& key : FindVisibleBlocks(view, options, 100'000)) {
      VoxelBlock& block = blocks[key];
      block.key = key;
      integrator.Integrate(&block);
    }
  }
  double sum = 0.0;
  int count = 0;
  for (const auto& [key, block] : blocks) {
    for (int i = 0; i < VoxelBlock::kCount; ++i) {
      const Voxel& voxel = block.voxels[i];
      if (!voxel.IsSeen() || std::abs(voxel.distance_m) > 1.5 * kVoxelM) continue;
      const Eigen::Vector3d at(8 * key.x + (i & 7) + 0.5, 8 * key.y + (i >> 3 & 7) + 0.5,
                               8 * key.z + (i >> 6) + 0.5);
      sum += std::abs(voxel.distance_m - scene.DistanceTo(at * kVoxelM));
      ++count;
    }
  }
  EXPECT_GT(count, 1000);
  return sum / std::max(count, 1);
}

std::vector<DepthFrame> FramesAround(const TestScene& scene) {
  std::vector<DepthFrame> frames;
  for (int i = 0; i < 12; ++i) {
    const double angle = i * M_PI / 6.0;
    frames.push_back(
        scene.Render(SmallCamera(),
                     LookAt({2.2 * std::cos(angle), 2.2 * std::sin(angle), 0.4}, {0.0, 0.0, 0.0})));
  }
  return frames;
}

TEST(VolumeGeometry, DistancesOfABallAreWithinAQuarterVoxel) {
  const TestScene scene = BallInRoom();
  EXPECT_LT(MeanBandError(scene, FramesAround(scene)), 0.25 * kVoxelM);
}

TEST(VolumeGeometry, DistancesOfABoxAreWithinAQuarterVoxel) {
  const TestScene scene = BoxInRoom();
  EXPECT_LT(MeanBandError(scene, FramesAround(scene)), 0.25 * kVoxelM);
}

TEST(VolumeGeometry, MeshLiesOnTheSurface) {
  for (const TestScene& scene : {BallInRoom(), BoxInRoom()}) {
    SemanticVolume volume((VolumeOptions()));
    WalkAround(scene, &volume);
    CollectedMesh mesh;
    mesh.Take(&volume);
    EXPECT_GT(mesh.face_count(), 5000u);
    EXPECT_LT(mesh.RmsError(scene), 0.15 * kVoxelM);
    EXPECT_LT(mesh.WorstError(scene), 0.8 * kVoxelM);
  }
}

TEST(VolumeGeometry, NormalsPointToTheFreeSide) {
  const TestScene scene = BallInRoom();
  SemanticVolume volume((VolumeOptions()));
  WalkAround(scene, &volume);
  size_t wrong = 0;
  size_t count = 0;
  for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
    for (const auto& face : block.faces) {
      const Eigen::Vector3f& a = block.positions_map[face[0]];
      const Eigen::Vector3f turned =
          (block.positions_map[face[1]] - a).cross(block.positions_map[face[2]] - a);
      for (const uint32_t vertex : face) {
        ++count;
        wrong += turned.dot(block.normals_map[vertex]) < 0.0f ? 1 : 0;
        const Eigen::Vector3d p = block.positions_map[vertex].cast<double>();
        const Eigen::Vector3d normal = block.normals_map[vertex].cast<double>();
        ASSERT_NEAR(normal.norm(), 1.0, 1e-4);
        wrong += scene.DistanceTo(p + 0.1 * normal) < 0.0 ? 1 : 0;
      }
    }
  }
  EXPECT_LT(wrong, count / 200);
}

TEST(VolumeGeometry, AWallSeenFromBothSidesHasTwoFacesWhereTheyAre) {
  constexpr double kWallM = 0.15;
  const TestScene scene{
      {RoomOf({-3, -3, -1.5}, {3, 3, 1.5}), SolidBox({-0.03, -3, -1.5}, {-0.03 + kWallM, 3, 1.5})}};
  SemanticVolume volume((VolumeOptions()));
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = -4; i <= 4; ++i) {
      const double y = 0.4 * i * (pass == 0 ? 1.0 : -1.0);
      Integrate(scene, {-2.0, y, 0.0}, {0.0, y + 0.5, 0.0}, &volume);
      Integrate(scene, {2.0, -y, 0.0}, {0.0, -y - 0.5, 0.0}, &volume);
    }
  }
  double sum = 0.0;
  int count = 0;
  int stray = 0;
  for (const MeshBlock& block : volume.TakeChangedMesh(2.0)) {
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3d p = block.positions_map[i].cast<double>();
      if (std::abs(p.x()) > 0.6 || std::abs(p.y()) > 1.0 || std::abs(p.z()) > 1.0) continue;
      ++count;
      sum += std::pow(scene.DistanceTo(p), 2);
      stray += std::abs(scene.DistanceTo(p)) > 0.5 * kVoxelM ? 1 : 0;
      // Each face of the wall shows to its own side.
      if ((p.x() > 0.045) != (block.normals_map[i].x() > 0.0f)) ++stray;
    }
  }
  EXPECT_GT(count, 600);
  EXPECT_EQ(stray, 0);
  EXPECT_LT(std::sqrt(sum / count), 0.2 * kVoxelM);
}

TEST(VolumeGeometry, AveragesNoiseAway) {
  const TestScene scene = BoxInRoom();
  constexpr uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  Random random(kSeed, 0);
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 60; ++i) {
    const double angle = i * M_PI / 30.0;
    DepthFrame frame = scene.Render(
        SmallCamera(), LookAt({2.0 * std::cos(angle), 2.0 * std::sin(angle), 0.4}, {0, 0, -0.5}));
    for (float& depth : frame.depth_m) {
      depth += static_cast<float>(random.Normal() * (0.0025 + 0.002 * depth * depth));
    }
    ASSERT_TRUE(volume.Integrate(frame).ok());
  }
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_LT(mesh.RmsError(scene), 0.2 * kVoxelM);
}

bool SameBytes(const std::vector<MeshBlock>& a, const std::vector<MeshBlock>& b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); ++i) {
    const auto same = [](const auto& x, const auto& y) {
      return x.size() == y.size() &&
             (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    if (a[i].index != b[i].index || !same(a[i].positions_map, b[i].positions_map) ||
        !same(a[i].normals_map, b[i].normals_map) || !same(a[i].colors, b[i].colors) ||
        !same(a[i].labels, b[i].labels) || !same(a[i].instance_ids, b[i].instance_ids) ||
        !same(a[i].faces, b[i].faces)) {
      return false;
    }
  }
  return true;
}

TEST(VolumeGeometry, OneThreadAndThreeMakeTheSameBytes) {
  TestScene scene = BoxInRoom();
  scene.shapes[0].label = 1 << 8;
  scene.shapes[1].label = 2 << 8 | 1;
  VolumeOptions options;
  options.thread_count = 1;
  SemanticVolume one(options);
  options.thread_count = 3;
  SemanticVolume three(options);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) {
      const double angle = (4 * round + i) * M_PI / 6.0;
      const DepthFrame frame = scene.Render(
          SmallCamera(), LookAt({2.0 * std::cos(angle), 2.0 * std::sin(angle), 0.4}, {0, 0, 0}));
      ASSERT_TRUE(one.Integrate(frame).ok());
      ASSERT_TRUE(three.Integrate(frame).ok());
    }
    const std::vector<MeshBlock> mesh = one.TakeChangedMesh(2.0);
    EXPECT_FALSE(mesh.empty());
    EXPECT_TRUE(SameBytes(mesh, three.TakeChangedMesh(2.0))) << "round " << round;
  }
  EXPECT_EQ(one.counts().block_count, three.counts().block_count);
  EXPECT_TRUE(one.MakeOccupancy(0.1).cells == three.MakeOccupancy(0.1).cells);
}

}  // namespace
}  // namespace dsg::ingest
