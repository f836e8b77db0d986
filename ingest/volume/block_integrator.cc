// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_integrator.h"

#include <algorithm>
#include <cmath>

namespace dsg::ingest {
namespace {

constexpr float kReadingNearM = 0.05f;

}  // namespace

BlockIntegrator::Numbers::Numbers(const FusionOptions& options)
    : full_weight_m(static_cast<float>(options.full_weight_m)),
      weight_max(static_cast<float>(options.weight_max)),
      free_weight_max(static_cast<float>(options.free_weight_max)),
      slanted_min(static_cast<float>(options.slanted_min)),
      through_wall(static_cast<float>(options.through_wall)),
      label_before_voxels(static_cast<float>(options.label_before_voxels)),
      label_behind_voxels(static_cast<float>(options.label_behind_voxels)),
      color_count_max(options.color_count_max) {}

BlockIntegrator::BlockIntegrator(const FrameView& view, const VolumeOptions& options,
                                 const std::vector<uint32_t>& instance_of_label)
    : view_(view),
      options_(options),
      numbers_(options.fusion),
      instance_of_label_(instance_of_label),
      camera_T_map_(view.frame().map_T_camera.Inverse()),
      steps_((camera_T_map_.orientation.toRotationMatrix() * options.voxel_m).cast<float>()),
      fx_(static_cast<float>(view.frame().camera.fx)),
      fy_(static_cast<float>(view.frame().camera.fy)),
      cx_(static_cast<float>(view.frame().camera.cx)),
      cy_(static_cast<float>(view.frame().camera.cy)) {}

void BlockIntegrator::Integrate(VoxelBlock* block) const {
  const Eigen::Vector3d first(block->key.x, block->key.y, block->key.z);
  const Eigen::Vector3d center =
      (first.array() * VoxelBlock::kSide + 0.5).matrix() * options_.voxel_m;
  // In double up to here: the map may be large, a block is small.
  const Eigen::Vector3f origin = (camera_T_map_ * center).cast<float>();
  block->updated = false;
  for (int z = 0; z < VoxelBlock::kSide; ++z) {
    for (int y = 0; y < VoxelBlock::kSide; ++y) {
      const Eigen::Vector3f start =
          origin + steps_.col(1) * static_cast<float>(y) + steps_.col(2) * static_cast<float>(z);
      FuseRow(start, steps_.col(0), VoxelBlock::IndexOf(0, y, z), block);
    }
  }
}

void BlockIntegrator::FuseRow(const Eigen::Vector3f& start, const Eigen::Vector3f& step, int first,
                              VoxelBlock* block) const {
  for (int i = 0; i < VoxelBlock::kSide; ++i) {
    const Eigen::Vector3f p = start + step * static_cast<float>(i);
    if (p.z() < kReadingNearM) continue;
    const float inverse = 1.0f / p.z();
    const float x = p.x() * inverse;
    const float y = p.y() * inverse;
    Reading reading;
    if (!view_.Read(fx_ * x + cx_, fy_ * y + cy_, &reading)) continue;
    if (!reading.is_surface) {
      if (p.z() < reading.depth_m) FuseFree(p.z(), block, first + i);
      continue;
    }
    const float scale = view_.DistanceScale(reading, x, y);
    const float distance = (reading.depth_m - p.z()) * scale;
    const float behind_m = view_.BehindM(reading.depth_m);
    if (distance <= -behind_m) continue;
    if (distance < view_.band().truncation_m) {
      const float cosine = scale / std::sqrt(x * x + y * y + 1.0f);
      float weight = WeightAt(p.z()) * std::max(cosine * cosine, numbers_.slanted_min);
      if (distance < 0.0f) weight *= 1.0f + distance / behind_m;
      FuseSurface(reading, distance, weight, block, first + i);
    } else {
      FuseFree(p.z(), block, first + i);
    }
  }
}

float BlockIntegrator::WeightAt(float depth) const {
  const float inverse = std::min(numbers_.full_weight_m / depth, 1.0f);
  const float weight = inverse * inverse;
  return view_.frame().is_stereo ? weight * weight : weight;
}

void BlockIntegrator::FuseDistance(float distance, float weight, float weight_max, Voxel* voxel) {
  const float total = voxel->weight + weight;
  voxel->distance_m += (distance - voxel->distance_m) * (weight / total);
  voxel->weight = std::min(total, std::max(weight_max, voxel->weight));
}

void BlockIntegrator::FuseFree(float depth, VoxelBlock* block, int index) const {
  Voxel& voxel = block->voxels[index];
  FuseDistance(view_.band().truncation_m, WeightAt(depth), numbers_.free_weight_max, &voxel);
  block->updated = true;
}

void BlockIntegrator::FuseSurface(const Reading& reading, float distance, float weight,
                                  VoxelBlock* block, int index) const {
  Voxel& voxel = block->voxels[index];
  if (distance < -view_.band().voxel_m && voxel.IsSeen() && voxel.distance_m > 0.0f) {
    weight *= numbers_.through_wall;
  }
  FuseDistance(std::max(distance, -view_.band().truncation_m), weight, numbers_.weight_max, &voxel);
  block->updated = true;
  block->has_surface = true;
  block->first_surface_ns = std::min(block->first_surface_ns, view_.frame().time_ns);
  block->last_surface_ns = std::max(block->last_surface_ns, view_.frame().time_ns);
  if (distance > numbers_.label_before_voxels * view_.band().voxel_m ||
      distance < -numbers_.label_behind_voxels * view_.band().voxel_m ||
      !view_.IsInsideSurface(reading.column, reading.row)) {
    return;
  }
  const size_t pixel = view_.Offset(reading.column, reading.row);
  if (!view_.frame().rgb.empty()) FuseColor(pixel, &voxel);
  if (!view_.frame().labels.empty()) FuseLabel(view_.frame().labels[pixel], block, index);
}

void BlockIntegrator::FuseColor(size_t pixel, Voxel* voxel) const {
  if (voxel->color_count < numbers_.color_count_max) ++voxel->color_count;
  const int count = voxel->color_count;
  for (size_t channel = 0; channel < 3; ++channel) {
    const int old = voxel->rgb[channel];
    const int seen = view_.frame().rgb[3 * pixel + channel];
    voxel->rgb[channel] = static_cast<uint8_t>((old * (count - 1) + seen + count / 2) / count);
  }
}

void BlockIntegrator::FuseLabel(uint16_t label, VoxelBlock* block, int index) const {
  const uint32_t class_id = label >> 8;
  if (class_id == 0) return;
  VoxelLabels* labels = block->MakeLabels(index);
  const uint32_t class_before = labels->classes.Best();
  const uint32_t instance_before = labels->instances.Best();
  labels->classes.Add(class_id);
  const uint32_t instance = instance_of_label_.empty() ? 0 : instance_of_label_[label];
  if (instance != 0) labels->instances.Add(instance);
  if (labels->classes.Best() != class_before || labels->instances.Best() != instance_before) {
    block->label_changed = true;
  }
}

}  // namespace dsg::ingest
