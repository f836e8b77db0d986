// SPDX-License-Identifier: Apache-2.0
// The volume after the path that it was seen from was corrected: moved, and fused again.
#include "ingest/volume/moved_blocks.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

constexpr uint16_t kBallLabel = 2 << 8 | 1;
const Eigen::Vector3d kBallMap(0.33, 0.24, 0.12);
// Near its surface, on the side that was seen.
const Eigen::Vector3d kInBallMap(1.02, 0.24, 0.12);

TestScene RoomWithABall() {
  TestScene scene{{RoomOf({-3, -3, -1.53}, {3, 3, 1.5}), Ball(kBallMap, 0.7)}};
  scene.shapes[0].label = 1 << 8;
  scene.shapes[1].label = kBallLabel;
  return scene;
}

// 16 pictures from a circle, one a second; those from `shifted_from` on are taken from where the
// robot was not: `error` further.
void FuseCircle(const TestScene& scene, int shifted_from, const Pose3d& error,
                SemanticVolume* volume) {
  for (int i = 0; i < 16; ++i) {
    const double angle = i * M_PI / 8.0;
    const Eigen::Vector3d eye(2.2 * std::cos(angle), 2.2 * std::sin(angle), 0.3);
    DepthFrame frame = scene.Render(SmallCamera(), LookAt(eye, {0, 0, -0.3}));
    frame.time_ns = i * kNsPerSecond;
    if (i >= shifted_from) frame.map_T_camera = error * frame.map_T_camera;
    EXPECT_TRUE(volume->Integrate(frame).ok());
  }
}

SemanticVolume SeenFromACircle(const TestScene& scene, int shifted_from, const Pose3d& error) {
  SemanticVolume volume((VolumeOptions()));
  FuseCircle(scene, shifted_from, error, &volume);
  return volume;
}

Pose3d Shift(double x, double y, double yaw_rad) {
  Pose3d pose;
  pose.position = {x, y, 0.0};
  pose.orientation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

// All was seen from elsewhere and moves back as one: the surface is where it is, all of it, and
// knows what it is.
TEST(MovedBlocks, PutTheSurfaceWhereItIs) {
  const TestScene scene = RoomWithABall();
  const Pose3d error = Shift(0.237, -0.114, 0.05);
  SemanticVolume right = SeenFromACircle(scene, 16, {});
  CollectedMesh truth;
  truth.Take(&right);
  SemanticVolume volume = SeenFromACircle(scene, 0, error);
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(mesh.WorstError(scene), 0.1);
  volume.Move(TrajectoryChange({0, 20 * kNsPerSecond}, {error, error}, {Pose3d(), Pose3d()}));
  mesh.Take(&volume);
  EXPECT_LT(mesh.RmsError(scene), 1.3 * truth.RmsError(scene) + 0.003);
  EXPECT_LT(mesh.WorstError(scene), truth.WorstError(scene) + 0.05);
  EXPECT_GT(mesh.vertex_count(), truth.vertex_count() * 95 / 100);
  EXPECT_LT(mesh.vertex_count(), truth.vertex_count() * 105 / 100);
  size_t ball_count = 0;
  size_t known_count = 0;
  for (const MeshBlock& block : mesh.blocks()) {
    for (size_t i = 0; i < block.labels.size(); ++i) {
      const double far_m = (block.positions_map[i].cast<double>() - kBallMap).norm();
      if (far_m > 0.75) continue;
      EXPECT_TRUE(block.labels[i] == 2u || block.labels[i] == 0u);
      known_count += block.labels[i] == 2u ? 1 : 0;
      ++ball_count;
    }
  }
  EXPECT_GT(ball_count, 200u);
  EXPECT_GT(known_count, ball_count * 98 / 100);
  EXPECT_EQ(volume.At(kInBallMap), Occupancy::kOccupied);
  EXPECT_EQ(volume.At({-1.8, 0.2, 0.4}), Occupancy::kFree);
}

// Nothing moved: no voxel is another, and no block of mesh is news.
TEST(MovedBlocks, StayWhereNothingMoves) {
  const TestScene scene = RoomWithABall();
  SemanticVolume volume = SeenFromACircle(scene, 16, {});
  CollectedMesh mesh;
  mesh.Take(&volume);
  volume.Move(TrajectoryChange({0, 20 * kNsPerSecond}, {Pose3d(), Pose3d()}, {Pose3d(), Pose3d()}));
  EXPECT_TRUE(volume.TakeChangedMesh(2.0).empty());
}

// The later half of the way was astray by less than a voxel a block: no seam tears open.
TEST(MovedBlocks, HaveNoGapsBetweenThem) {
  const TestScene scene = RoomWithABall();
  SemanticVolume volume = SeenFromACircle(scene, 16, {});
  CollectedMesh before;
  before.Take(&volume);
  // A turn of 3 degrees that comes over the way.
  volume.Move(TrajectoryChange({0, 15 * kNsPerSecond}, {Pose3d(), Pose3d()},
                               {Pose3d(), Shift(0.1, 0.0, 0.05)}));
  CollectedMesh after;
  after.Take(&volume);
  EXPECT_GT(after.vertex_count(), before.vertex_count() * 93 / 100);
  EXPECT_EQ(volume.At(kInBallMap), Occupancy::kOccupied);
}

// What was fused again is what a volume is that saw nothing else, and what was there before is
// gone.
TEST(ClearedVolume, IsFusedAnew) {
  const TestScene scene = RoomWithABall();
  SemanticVolume right = SeenFromACircle(scene, 16, {});
  CollectedMesh truth;
  truth.Take(&right);
  SemanticVolume volume = SeenFromACircle(scene, 5, Shift(0.4, 0.3, 0.1));
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(mesh.WorstError(scene), 0.1);
  volume.Clear();
  EXPECT_EQ(volume.counts().frame_count, 0);
  EXPECT_EQ(volume.At(kInBallMap), Occupancy::kUnknown);
  FuseCircle(scene, 16, {}, &volume);
  mesh.Take(&volume);
  EXPECT_EQ(mesh.vertex_count(), truth.vertex_count());
  EXPECT_DOUBLE_EQ(mesh.RmsError(scene), truth.RmsError(scene));
  EXPECT_EQ(volume.counts().frame_count, 16);
  EXPECT_EQ(volume.counts().block_count, right.counts().block_count);
}

TEST(MovedBlocks, FramesGoOnInTheMovedVolume) {
  const TestScene scene = RoomWithABall();
  const Pose3d error = Shift(0.3, 0.2, 0.0);
  SemanticVolume volume = SeenFromACircle(scene, 0, error);
  volume.Move(TrajectoryChange({0, 20 * kNsPerSecond}, {error, error}, {Pose3d(), Pose3d()}));
  DepthFrame frame = scene.Render(SmallCamera(), LookAt({2.0, 0.5, 0.6}, {0, 0, -0.3}));
  frame.time_ns = 30 * kNsPerSecond;
  ASSERT_TRUE(volume.Integrate(frame).ok());
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_LT(mesh.WorstError(scene), 0.1);
}

}  // namespace
}  // namespace dsg::ingest
