// SPDX-License-Identifier: Apache-2.0
// Frames that cannot be are refused and leave no trace; those that are merely bad do little harm.
#include <gtest/gtest.h>

#include <limits>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/volume/test_scene.h"

namespace dsg::ingest {
namespace {

TestScene Room() { return {{RoomOf({-3, -3, -1.5}, {3, 3, 1.5})}}; }

DepthFrame GoodFrame() {
  return Room().Render(SmallCamera(), LookAt({-2.0, 0.0, 0.0}, {2.0, 0.3, 0.1}));
}

TEST(VolumeOptions, NamesTheFieldThatCannotBe) {
  EXPECT_TRUE(VolumeOptions().Validate().ok());
  const auto field_of = [](const auto& change) {
    VolumeOptions options;
    change(&options);
    const absl::Status status = options.Validate();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid);
    return MetadataOf(status)["field"];
  };
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->voxel_m = 0.0; }), "--voxel");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->voxel_m = NAN; }), "--voxel");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->truncation_m = 0.01; }), "truncation_m");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->range_m = INFINITY; }), "--range");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->label_confidence = 1.0; }),
            "volume-label-confidence");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->thread_count = 0; }), "--threads");
  EXPECT_EQ(field_of([](VolumeOptions* o) { o->block_count_max = 0; }), "block_count_max");
}

TEST(VolumeBounds, RefusesFramesThatDoNotFitAndStaysAsItWas) {
  SemanticVolume volume((VolumeOptions()));
  ASSERT_TRUE(volume.Integrate(GoodFrame()).ok());
  EXPECT_FALSE(volume.TakeChangedMesh(2.0).empty());
  const VolumeCounts before = volume.counts();
  const auto refuses = [&](const auto& change) {
    DepthFrame frame = GoodFrame();
    change(&frame);
    const absl::Status status = volume.Integrate(frame);
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << status;
  };
  refuses([](DepthFrame* f) { f->depth_m.pop_back(); });
  refuses([](DepthFrame* f) { f->depth_m.clear(); });
  refuses([](DepthFrame* f) { f->rgb.pop_back(); });
  refuses([](DepthFrame* f) { f->labels.resize(10); });
  refuses([](DepthFrame* f) { f->dynamic.resize(f->dynamic.size() + 1); });
  refuses([](DepthFrame* f) { f->camera.fx = 0.0; });
  refuses([](DepthFrame* f) { f->camera.width = -160; });
  refuses([](DepthFrame* f) { f->map_T_camera.position.x() = NAN; });
  refuses([](DepthFrame* f) { f->map_T_camera.position.y() = 1e12; });
  refuses([](DepthFrame* f) { f->map_T_camera.orientation.coeffs() *= 1.1; });
  refuses([](DepthFrame* f) {
    f->camera.distortion = Distortion::kRadialTangential;
    f->camera.distortion_coefficients = {0.1, 0.0, 0.0, 0.0};
  });
  EXPECT_EQ(volume.counts().frame_count, before.frame_count);
  EXPECT_EQ(volume.counts().pixel_count, before.pixel_count);
  EXPECT_EQ(volume.counts().block_count, before.block_count);
  EXPECT_TRUE(volume.TakeChangedMesh(2.0).empty());
}

TEST(VolumeBounds, PixelsThatAreNoNumbersAreHoles) {
  DepthFrame frame = GoodFrame();
  constexpr uint64_t kSeed = 8;
  SCOPED_TRACE(kSeed);
  Random random(kSeed, 0);
  const float bad[] = {0.0f, -1.0f, -std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN()};
  for (float& depth : frame.depth_m) {
    if (random.Chance(0.3)) depth = bad[random.Index(5)];
  }
  SemanticVolume volume((VolumeOptions()));
  ASSERT_TRUE(volume.Integrate(frame).ok());
  CollectedMesh mesh;
  mesh.Take(&volume);
  EXPECT_GT(mesh.face_count(), 100u);
  EXPECT_LT(mesh.WorstError(Room()), 0.1);
  for (float& depth : frame.depth_m) depth = std::numeric_limits<float>::quiet_NaN();
  SemanticVolume blind((VolumeOptions()));
  ASSERT_TRUE(blind.Integrate(frame).ok());
  EXPECT_EQ(blind.counts().block_count, 0);
  EXPECT_EQ(blind.counts().pixel_count, 0);
}

TEST(VolumeBounds, GarbageMakesNoMoreBlocksThanAllowed) {
  VolumeOptions options;
  options.block_count_max = 700;
  SemanticVolume volume(options);
  constexpr uint64_t kSeed = 9;
  SCOPED_TRACE(kSeed);
  Random random(kSeed, 0);
  for (int i = 0; i < 20; ++i) {
    DepthFrame frame = GoodFrame();
    for (float& depth : frame.depth_m) depth = static_cast<float>(random.Uniform(0.0, 1e4));
    frame.map_T_camera.position = {random.Uniform(-1e3, 1e3), random.Uniform(-1e3, 1e3), 0.0};
    // The widest view that a calibration may have.
    if (i % 3 == 0) frame.camera.fx = frame.camera.width / 11.0;
    ASSERT_TRUE(volume.Integrate(frame).ok());
    EXPECT_LE(volume.counts().block_count, 700);
    volume.TakeChangedMesh(2.0);
  }
  EXPECT_GT(volume.counts().refused_block_count, 0);
  EXPECT_LE(volume.MakeOccupancy(0.1).frame.CellCount(), int64_t{300'000'000});
}

// A jump of the pose leaves blocks at the other end of the world.
TEST(VolumeBounds, BlocksThatNoGridCanHoldAreCounted) {
  SemanticVolume volume((VolumeOptions()));
  for (int i = 0; i < 6; ++i) {
    DepthFrame frame = GoodFrame();
    frame.map_T_camera.position.x() += 6.0 * i;
    ASSERT_TRUE(volume.Integrate(frame).ok());
  }
  EXPECT_GT(volume.MakeOccupancy(0.1).frame.CellCount(), 0);
  EXPECT_EQ(volume.counts().cut_block_count, 0);
  const int64_t near_count = volume.counts().block_count;
  DepthFrame far = GoodFrame();
  far.map_T_camera.position += Eigen::Vector3d(5e4, 5e4, 0.0);
  ASSERT_TRUE(volume.Integrate(far).ok());
  const int64_t far_count = volume.counts().block_count - near_count;
  ASSERT_GT(far_count, 0);
  const OccupancyGrid grid = volume.MakeOccupancy(0.1);
  EXPECT_EQ(grid.AtPoint({18.0, 0.0, 0.0}), Occupancy::kFree);
  EXPECT_GE(volume.counts().cut_block_count, far_count);
  EXPECT_LT(volume.counts().cut_block_count, near_count);
}

TEST(VolumeBounds, ReadingsBeyondTheRangeClearFreeSpaceOnly) {
  VolumeOptions options;
  options.range_m = 3.0;
  SemanticVolume volume(options);
  ASSERT_TRUE(volume.Integrate(GoodFrame()).ok());
  EXPECT_EQ(volume.At({0.5, 0.0, 0.0}), Occupancy::kFree);
  EXPECT_EQ(volume.At({1.5, 0.0, 0.0}), Occupancy::kUnknown);
  EXPECT_EQ(volume.At({2.95, 0.0, 0.0}), Occupancy::kUnknown);
}

TEST(VolumeBounds, AnImageOfOnePixelIsAFrameToo) {
  DepthFrame frame;
  frame.camera = SmallCamera();
  frame.camera.width = frame.camera.height = 1;
  frame.camera.cx = frame.camera.cy = 0.0;
  frame.camera.fx = frame.camera.fy = 5.0;
  frame.depth_m = {2.0f};
  SemanticVolume volume((VolumeOptions()));
  EXPECT_TRUE(volume.Integrate(frame).ok());
  EXPECT_GT(volume.counts().block_count, 0);
}

TEST(VolumeBounds, AnEmptyVolumeHasNothingToShow) {
  SemanticVolume volume((VolumeOptions()));
  EXPECT_TRUE(volume.TakeChangedMesh(2.0).empty());
  EXPECT_EQ(volume.MakeOccupancy(0.1).frame.CellCount(), 0);
  EXPECT_EQ(volume.At({0, 0, 0}), Occupancy::kUnknown);
  EXPECT_EQ(volume.At({NAN, 0, 0}), Occupancy::kUnknown);
}

}  // namespace
}  // namespace dsg::ingest
