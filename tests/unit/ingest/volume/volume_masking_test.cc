// SPDX-License-Identifier: Apache-2.0
// People leave no trace when their pixels are known, and clear the way to themselves.
#include <gtest/gtest.h>

#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

constexpr double kBallM = 0.3;

Eigen::Vector3d VisitorAt(int step) { return {1.5, -0.3 + 0.04 * step, 0.0}; }

TestScene RoomWithVisitor(int step) {
  TestScene scene{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5}), Ball(VisitorAt(step), kBallM)}};
  scene.shapes[0].label = 1 << 8;
  scene.shapes[1].label = 20 << 8 | 1;
  scene.shapes[1].is_person = true;
  return scene;
}

void Watch(DynamicMasking masking, int first, int last, SemanticVolume* volume,
           TimeNs period_ns = 200'000'000) {
  ASSERT_EQ(volume->options().masking, masking);
  for (int step = first; step < last; ++step) {
    DepthFrame frame =
        RoomWithVisitor(step).Render(SmallCamera(), LookAt({-2.0, 0.0, 0.2}, {2.0, 0.0, 0.0}));
    frame.time_ns = step * period_ns;
    ASSERT_TRUE(volume->Integrate(frame).ok());
  }
}

SemanticVolume VolumeWith(DynamicMasking masking) {
  VolumeOptions options;
  options.masking = masking;
  return SemanticVolume(options);
}

size_t GhostVertices(const CollectedMesh& mesh) {
  const TestScene room{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5})}};
  size_t count = 0;
  for (const MeshBlock& block : mesh.blocks()) {
    for (const Eigen::Vector3f& p : block.positions_map) {
      count += room.DistanceTo(p.cast<double>()) > 0.15 ? 1 : 0;
    }
  }
  return count;
}

TEST(VolumeMasking, ForgetsNobodyBehindAPersonWithoutTheMask) {
  for (const DynamicMasking masking : {DynamicMasking::kCarve, DynamicMasking::kDrop}) {
    SemanticVolume volume = VolumeWith(masking);
    Watch(masking, 0, 13, &volume);
    CollectedMesh mesh;
    mesh.Take(&volume);
    EXPECT_GT(mesh.face_count(), 1000u);
    EXPECT_EQ(GhostVertices(mesh), 0u);
    for (const MeshBlock& block : mesh.blocks()) {
      for (const uint32_t label : block.labels) ASSERT_NE(label, 20u);
    }
  }
  SemanticVolume volume = VolumeWith(DynamicMasking::kOff);
  Watch(DynamicMasking::kOff, 0, 13, &volume);
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(GhostVertices(mesh), 20u);
}

TEST(VolumeMasking, OnlyCarvingClearsTheWayToAPerson) {
  const Eigen::Vector3d before = VisitorAt(6) - Eigen::Vector3d(1.2, 0.0, 0.0);
  SemanticVolume carved = VolumeWith(DynamicMasking::kCarve);
  Watch(DynamicMasking::kCarve, 6, 7, &carved);
  EXPECT_EQ(carved.At(before), Occupancy::kFree);
  EXPECT_EQ(carved.At(VisitorAt(6) - Eigen::Vector3d(kBallM + 0.2, 0, 0)), Occupancy::kUnknown);
  EXPECT_EQ(carved.At(VisitorAt(6)), Occupancy::kUnknown);
  EXPECT_EQ(carved.counts().dynamic_pixel_count > 0, true);
  SemanticVolume dropped = VolumeWith(DynamicMasking::kDrop);
  Watch(DynamicMasking::kDrop, 6, 7, &dropped);
  EXPECT_EQ(dropped.At(before), Occupancy::kUnknown);
}

TEST(VolumeMasking, ASurfaceThatIsSeenThroughGoes) {
  SemanticVolume volume = VolumeWith(DynamicMasking::kOff);
  for (int i = 0; i < 10; ++i) Watch(DynamicMasking::kOff, 6, 7, &volume);
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(mesh.CountNear(VisitorAt(6), 0.5), 20u);
  const TestScene empty{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5})}};
  const DepthFrame frame = empty.Render(SmallCamera(), LookAt({-2.0, 0.0, 0.2}, {2.0, 0.0, 0.0}));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(volume.Integrate(frame).ok());
  mesh.Take(&volume);
  EXPECT_EQ(mesh.CountNear(VisitorAt(6), 0.5), 0u);
  EXPECT_EQ(GhostVertices(mesh), 0u);
}

// Distances are averages, and those of free space are large: no detector sees the visitor.
TEST(VolumeMasking, ABriefVisitorLeavesNothingWhereItWasFreeAndWhatStaysAppears) {
  const Pose3d pose = LookAt({-1.0, 0.0, 0.2}, {2.0, 0.0, 0.0});
  const TestScene empty{{RoomOf({-3, -3, -1.5}, {3, 3, 1.5})}};
  const TestScene visited{{empty.shapes[0], Ball({1.5, 0.0, 0.0}, kBallM)}};
  const DepthFrame without = empty.Render(SmallCamera(), pose);
  const DepthFrame with = visited.Render(SmallCamera(), pose);
  SemanticVolume volume = VolumeWith(DynamicMasking::kOff);
  const auto watch = [&](const DepthFrame& frame, int frames) {
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(volume.Integrate(frame).ok());
  };
  CollectedMesh mesh;
  watch(without, 40);
  watch(with, 10);
  mesh.Take(&volume);
  EXPECT_EQ(GhostVertices(mesh), 0u);
  watch(with, 80);
  mesh.Take(&volume);
  EXPECT_GT(mesh.CountNear({1.5, 0.0, 0.0}, kBallM + 0.1), 40u);
}

}  // namespace
}  // namespace dsg::ingest
