// SPDX-License-Identifier: Apache-2.0
// Blocks of the volume that wait on disk: the result is the same, memory is bounded, and a disk
// that fails is told.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <tuple>

#include "ingest/volume/block_bytes.h"
#include "ingest/volume/block_map.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/open_files.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

using test::TempFolder;

constexpr double kAll = 1e8;
constexpr int kStepCount = 40;

// A corridor of 24 m with balls in it.
TestScene Corridor() {
  TestScene scene{{RoomOf({-2, -2, -1.53}, {22, 2, 1.5})}};
  scene.shapes[0].label = 1 << 8;
  for (int i = 0; i < 5; ++i) {
    scene.shapes.push_back(Ball({4.0 * i + 1.0, i % 2 == 0 ? 1.2 : -1.1, -0.8}, 0.5));
    scene.shapes.back().label = static_cast<uint16_t>(2 << 8 | (i + 1));
  }
  return scene;
}

// There, and halfway back.
DepthFrame FrameAt(const TestScene& scene, int step) {
  const double x = step < 27 ? 0.75 * step : 0.75 * (54 - step);
  const double side = 0.4 * std::sin(0.5 * step);
  const double ahead = step < 27 ? 3.0 : -3.0;
  DepthFrame frame = scene.Render(SmallCamera(), LookAt({x, side, 0.2}, {x + ahead, -side, -0.3}));
  frame.time_ns = step * kNsPerSecond;
  return frame;
}

VolumeOptions Keeping(double resident_block_count, const std::string& folder = "") {
  VolumeOptions options;
  options.range_m = 5.0;
  options.spill.resident_block_count = resident_block_count;
  options.spill.folder = folder;
  return options;
}

auto Parts(const MeshBlock& block) {
  return std::tie(block.positions_map, block.normals_map, block.colors, block.labels,
                  block.instance_ids, block.first_seen_ns, block.last_seen_ns, block.faces);
}

void ExpectSame(const std::vector<MeshBlock>& a, const std::vector<MeshBlock>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].index, b[i].index);
    EXPECT_TRUE(Parts(a[i]) == Parts(b[i])) << "block " << i;
  }
}

void ExpectSame(SemanticVolume& a, SemanticVolume& b) {
  ExpectSame(a.TakeChangedMesh(2.0), b.TakeChangedMesh(2.0));
  const OccupancyGrid grid = a.MakeOccupancy(0.1);
  const OccupancyGrid other = b.MakeOccupancy(0.1);
  EXPECT_EQ(grid.frame.origin_map, other.frame.origin_map);
  EXPECT_EQ(grid.frame.size, other.frame.size);
  EXPECT_EQ(grid.cells, other.cells);
  for (double x = -2.5; x < 23.0; x += 0.31) {
    for (double y = -2.5; y < 2.5; y += 0.07) EXPECT_EQ(a.At({x, y, 0.11}), b.At({x, y, 0.11}));
  }
}

class SpilledVolume : public testing::TestWithParam<double> {};

// Of a walk with meshes on the way, a correction of the path, and a way back after it.
TEST_P(SpilledVolume, IsTheSameVolume) {
  const TestScene scene = Corridor();
  const TempFolder folder;
  SemanticVolume kept(Keeping(kAll));
  SemanticVolume spilled(Keeping(GetParam(), folder.path()));
  Pose3d moved;
  moved.position = {0.137, -0.061, 0.0};
  moved.orientation = Eigen::AngleAxisd(0.013, Eigen::Vector3d::UnitZ());
  for (int step = 0; step < kStepCount; ++step) {
    const DepthFrame frame = FrameAt(scene, step);
    ASSERT_TRUE(kept.Integrate(frame).ok());
    ASSERT_TRUE(spilled.Integrate(frame).ok());
    EXPECT_LE(spilled.counts().resident_block_count, GetParam());
    if (step % 6 == 5) ExpectSame(kept, spilled);
    if (step == 30) {
      const TrajectoryChange change({5 * kNsPerSecond, 25 * kNsPerSecond}, {Pose3d(), Pose3d()},
                                    {Pose3d(), moved});
      kept.Move(change);
      spilled.Move(change);
      ASSERT_TRUE(spilled.status().ok()) << spilled.status();
      EXPECT_LE(spilled.counts().resident_block_count, GetParam());
    }
  }
  ExpectSame(kept, spilled);
  EXPECT_TRUE(spilled.status().ok()) << spilled.status();
  const VolumeCounts counts = spilled.counts();
  EXPECT_EQ(counts.block_count, kept.counts().block_count);
  EXPECT_EQ(kept.counts().resident_block_count, counts.block_count);
  EXPECT_GT(counts.block_count, 2000);
  EXPECT_FALSE(test::OpenFilesIn(folder.path()).empty());
}

INSTANTIATE_TEST_SUITE_P(WithSoManyBlocksInMemory, SpilledVolume,
                         testing::Values(1.0, 100.0, 1500.0));

TEST(VolumeOnDisk, TellsThatTheDiskIsFull) {
  const TestScene scene = Corridor();
  const TempFolder folder;
  SemanticVolume volume(Keeping(100, folder.path()));
  absl::Status status;
  {
    const test::FullDisk full(100'000);
    for (int step = 0; step < kStepCount && status.ok(); ++step) {
      status = volume.Integrate(FrameAt(scene, step));
    }
  }
  EXPECT_EQ(ReasonOf(status), Reason::kDiskFull) << status;
  EXPECT_NE(status.message().find("--resident-blocks"), std::string::npos) << status;
  // It stays so: what would come of it may be wrong.
  EXPECT_EQ(volume.Integrate(FrameAt(scene, 0)), status);
  EXPECT_EQ(volume.status(), status);
}

TEST(VolumeOnDisk, RefusesWhatTheDiskHasChanged) {
  const TestScene scene = Corridor();
  for (const bool is_cut : {false, true}) {
    const TempFolder folder;
    SemanticVolume volume(Keeping(100, folder.path()));
    ASSERT_TRUE(volume.Integrate(FrameAt(scene, 0)).ok());
    const std::vector<int> open = test::OpenFilesIn(folder.path());
    ASSERT_EQ(open.size(), 1u);
    const off_t end = lseek(open[0], 0, SEEK_END);
    if (is_cut) {
      ASSERT_EQ(ftruncate(open[0], end / 2), 0);
    } else {
      for (off_t at = 500; at < end; at += 1024) {
        char byte = 0;
        ASSERT_EQ(pread(open[0], &byte, 1, at), 1);
        byte = static_cast<char>(byte ^ 16);
        ASSERT_EQ(pwrite(open[0], &byte, 1, at), 1);
      }
    }
    volume.TakeChangedMesh(2.0);
    EXPECT_TRUE(absl::IsDataLoss(volume.status())) << volume.status();
    EXPECT_TRUE(absl::IsDataLoss(volume.Integrate(FrameAt(scene, 1))));
  }
}

TEST(BlockBytes, AreTheBlock) {
  Random random(3, 0);
  for (const int labelled : {0, 1, 200, VoxelBlock::kCount}) {
    VoxelBlock block;
    block.first_seen_ns = 5;
    block.last_surface_ns = kTimeMax - 1;
    block.has_surface = labelled > 0;
    block.queued = true;
    for (Voxel& voxel : block.voxels) {
      voxel.distance_m = static_cast<float>(random.Uniform(-1.0, 1.0));
      voxel.weight = static_cast<float>(random.Uniform(0.0, 4.0));
      voxel.rgb = {1, 2, static_cast<uint8_t>(random.Uniform(0.0, 255.0))};
      voxel.color_count = 9;
      voxel.published = static_cast<int16_t>(random.Uniform(-32000.0, 32000.0));
    }
    for (int i = 0; i < labelled; ++i) {
      VoxelLabels* const labels = block.MakeLabels(VoxelBlock::kCount - 1 - i);
      labels->classes.Add(static_cast<uint32_t>(i % 40 + 1));
      labels->instances.Add(static_cast<uint32_t>(i * 1000 + 1));
    }
    const std::string bytes = EncodeBlock(block);
    VoxelBlock back;
    ASSERT_TRUE(DecodeBlock(bytes, &back));
    EXPECT_EQ(EncodeBlock(back), bytes);
    EXPECT_EQ(back.voxels[77].distance_m, block.voxels[77].distance_m);
    EXPECT_EQ(back.voxels[511].published, block.voxels[511].published);
    EXPECT_EQ(back.last_surface_ns, block.last_surface_ns);
    EXPECT_EQ(back.has_surface, block.has_surface);
    EXPECT_TRUE(back.queued);
    EXPECT_FALSE(back.updated);
    EXPECT_EQ(back.labels.size(), static_cast<size_t>(labelled));
    for (size_t size = 0; size < bytes.size(); size += 97) {
      EXPECT_FALSE(DecodeBlock(bytes.substr(0, size), &back));
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
