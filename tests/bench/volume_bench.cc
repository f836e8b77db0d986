// SPDX-License-Identifier: Apache-2.0
// What a keyframe costs the semantic volume, fusion and mesh, in a furnished hall; beside a plain
// copy of the frame, which is the least that any stage must do with it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "ingest/volume/semantic_volume.h"

namespace dsg::bench {
namespace {

constexpr int kFrameCount = 40;
constexpr int kFramesPerMesh = 5;

struct Slab {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

// Where a ray enters a box, or leaves it when it starts inside; 0 = it misses.
double HitBox(const Slab& box, const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
  const Eigen::Array3d a = (box.low - eye).array() / ray.array();
  const Eigen::Array3d b = (box.high - eye).array() / ray.array();
  const double enter = a.min(b).maxCoeff();
  const double leave = a.max(b).minCoeff();
  if (enter > leave || leave <= 0.0) return 0.0;
  return enter > 0.0 ? enter : leave;
}

// A hall of 16 x 12 x 3 m with rows of desks.
std::vector<Slab> MakeHall() {
  std::vector<Slab> hall{{{-8.0, -6.0, 0.0}, {8.0, 6.0, 3.0}}};
  for (int i = 0; i < 24; ++i) {
    const Eigen::Vector3d low(-7.0 + 2.5 * (i % 6), -5.0 + 2.8 * (i / 6), 0.0);
    hall.push_back({low, low + Eigen::Vector3d(1.4, 0.7, 0.75)});
  }
  return hall;
}

ingest::DepthFrame Render(const std::vector<Slab>& hall, int number) {
  ingest::DepthFrame frame;
  frame.time_ns = number * int64_t{200'000'000};
  frame.camera.name = "depth0";
  frame.camera.width = 720;
  frame.camera.height = 480;
  frame.camera.fx = frame.camera.fy = 415.692;
  frame.camera.cx = 359.5;
  frame.camera.cy = 239.5;
  // Walks along the hall and looks around.
  frame.map_T_camera.position = {-5.0 + 0.2 * number, 0.3 * std::sin(0.3 * number), 1.4};
  const double yaw = 0.15 * number;
  Eigen::Matrix3d map_R_camera;
  map_R_camera.col(0) = Eigen::Vector3d(std::sin(yaw), -std::cos(yaw), 0.0);
  map_R_camera.col(1) = -Eigen::Vector3d::UnitZ();
  map_R_camera.col(2) = Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
  frame.map_T_camera.orientation = Eigen::Quaterniond(map_R_camera).normalized();
  const size_t count = size_t{720} * 480;
  frame.depth_m.resize(count);
  frame.labels.resize(count);
  frame.rgb.assign(3 * count, 128);
  frame.dynamic.assign(count, 0);
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d ray =
        map_R_camera * Eigen::Vector3d((static_cast<double>(i % 720) - frame.camera.cx) / 415.692,
                                       (static_cast<double>(i / 720) - frame.camera.cy) / 415.692,
                                       1.0);
    double nearest = HitBox(hall[0], frame.map_T_camera.position, ray);
    uint16_t label = 1 << 8;
    for (size_t k = 1; k < hall.size(); ++k) {
      const double hit = HitBox(hall[k], frame.map_T_camera.position, ray);
      if (hit <= 0.0 || hit >= nearest) continue;
      nearest = hit;
      label = static_cast<uint16_t>(10 << 8 | k);
    }
    frame.depth_m[i] = static_cast<float>(nearest);
    frame.labels[i] = label;
  }
  return frame;
}

const std::vector<ingest::DepthFrame>& Frames() {
  static const std::vector<ingest::DepthFrame> frames = [] {
    const std::vector<Slab> hall = MakeHall();
    std::vector<ingest::DepthFrame> made;
    for (int i = 0; i < kFrameCount; ++i) made.push_back(Render(hall, i));
    return made;
  }();
  return frames;
}

ingest::VolumeOptions OptionsOf(const benchmark::State& state) {
  ingest::VolumeOptions options;
  options.voxel_m = static_cast<double>(state.range(0)) / 100.0;
  return options;
}

void Fuse(const ingest::DepthFrame& frame, ingest::SemanticVolume* volume) {
  if (volume->Integrate(frame).ok()) return;
  std::fprintf(stderr, "volume_bench: a frame was refused\n");
  std::abort();
}

// A first walk through the hall: most blocks are new.
void FuseKeyframe(benchmark::State& state) {
  Frames();
  for (auto _ : state) {
    ingest::SemanticVolume volume(OptionsOf(state));
    for (const ingest::DepthFrame& frame : Frames()) Fuse(frame, &volume);
    state.counters["blocks"] = static_cast<double>(volume.counts().block_count);
  }
  state.SetItemsProcessed(state.iterations() * kFrameCount);
}

// Mesh after every fifth keyframe; time of the mesh alone, per keyframe.
void MeshKeyframe(benchmark::State& state) {
  Frames();
  for (auto _ : state) {
    state.PauseTiming();
    ingest::SemanticVolume volume(OptionsOf(state));
    size_t block_count = 0;
    for (int i = 0; i < kFrameCount; ++i) {
      Fuse(Frames()[i], &volume);
      if (i % kFramesPerMesh != kFramesPerMesh - 1) continue;
      state.ResumeTiming();
      block_count += volume.TakeChangedMesh(2.0).size();
      state.PauseTiming();
    }
    state.counters["blocks/mesh"] = static_cast<double>(block_count) * kFramesPerMesh / kFrameCount;
    state.ResumeTiming();
  }
  state.SetItemsProcessed(state.iterations() * kFrameCount);
}

void CopyKeyframe(benchmark::State& state) {
  Frames();
  for (auto _ : state) {
    for (const ingest::DepthFrame& frame : Frames()) {
      ingest::DepthFrame copy = frame;
      benchmark::DoNotOptimize(copy.depth_m.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * kFrameCount);
}

BENCHMARK(CopyKeyframe)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(FuseKeyframe)->Arg(10)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(MeshKeyframe)->Arg(10)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace dsg::bench

BENCHMARK_MAIN();
