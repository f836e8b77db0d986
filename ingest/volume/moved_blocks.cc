// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/moved_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace dsg::ingest {
namespace {

// A block that moves by less stays where it is: sampling would blur it for nothing.
constexpr double kStillM = 1e-4;
// Blocks that are poured one after another before others may go to disk.
constexpr int64_t kPouredAtOnce = 64;

// The value of a volume at a point.
struct Sample {
  float distance_m = 0.0f;
  const VoxelBlock* block = nullptr;
  int index = 0;

  const Voxel& voxel() const { return block->voxels[static_cast<size_t>(index)]; }
};

class Sampler {
 public:
  explicit Sampler(const BlockMap& blocks) : blocks_(blocks) {}

  // Of the voxel that holds the point, its distance interpolated where all around is seen.
  std::optional<Sample> At(const Eigen::Vector3d& point_map) {
    Sample sample;
    if (!Find(blocks_.VoxelOf(point_map), &sample) || !sample.voxel().IsSeen()) return {};
    sample.distance_m = Interpolated(point_map).value_or(sample.voxel().distance_m);
    return sample;
  }

  // Before blocks go to disk.
  void LetGo() { last_ = nullptr; }

 private:
  bool Find(const Eigen::Vector3i& voxel, Sample* sample) {
    const BlockKey key = BlockMap::KeyOf(voxel);
    if (last_ == nullptr || last_->key != key) last_ = blocks_.Find(key);
    sample->block = last_;
    sample->index = BlockMap::IndexOf(voxel);
    return last_ != nullptr;
  }

  std::optional<float> Interpolated(const Eigen::Vector3d& point_map) {
    const Eigen::Vector3d at = (point_map / blocks_.voxel_m()).array() - 0.5;
    const Eigen::Vector3i low = at.array().floor().cast<int>();
    const Eigen::Vector3d share = at - low.cast<double>();
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2);
      Sample sample;
      if (!Find(low + step, &sample) || !sample.voxel().IsSeen()) return {};
      double weight = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        weight *= step[axis] == 1 ? share[axis] : 1.0 - share[axis];
      }
      sum += weight * static_cast<double>(sample.voxel().distance_m);
    }
    return static_cast<float>(sum);
  }

  const BlockMap& blocks_;
  const VoxelBlock* last_ = nullptr;
};

class Mover {
 public:
  Mover(const BlockMap& blocks, const TrajectoryChange& change)
      : blocks_(blocks), voxel_m_(blocks.voxel_m()), moved_(blocks.MakeEmpty()), sampler_(blocks) {
    for (int64_t i = 0; i < blocks_.size(); ++i) {
      moves_.push_back(MoveOfBlock(i, change));
      Trim(i);
    }
  }

  BlockMap Move() {
    // First what each block holds itself, then the seams between blocks.
    for (int64_t i = 0; i < blocks_.size(); ++i) {
      Pour(i, 0.0);
      Trim(i);
    }
    for (int64_t i = 0; i < blocks_.size(); ++i) {
      if (!moves_[static_cast<size_t>(i)].has_value()) continue;
      Pour(i, 0.5 * voxel_m_);
      Trim(i);
    }
    return std::move(moved_);
  }

 private:
  // Errors stay in the maps.
  void Trim(int64_t number) {
    if (number % kPouredAtOnce != 0) return;
    sampler_.LetGo();
    last_ = nullptr;
    blocks_.Trim().IgnoreError();
    moved_.Trim().IgnoreError();
  }

  // Unset for a block that stays.
  std::optional<Pose3d> MoveOfBlock(int64_t number, const TrajectoryChange& change) const {
    const VoxelBlock& block = blocks_.block(number);
    const Box3d box = BoxOf(block);
    const Pose3d move =
        block.has_surface
            ? MoveOf(box.center(), block.first_surface_ns, block.last_surface_ns, change)
            : MoveOf(box.center(), block.first_seen_ns, block.last_seen_ns, change);
    const double far_m =
        std::max((move * box.min() - box.min()).norm(), (move * box.max() - box.max()).norm());
    return far_m < kStillM ? std::nullopt : std::optional<Pose3d>(move);
  }

  Box3d BoxOf(const VoxelBlock& block) const {
    const double edge_m = VoxelBlock::kSide * voxel_m_;
    const Eigen::Vector3d low = edge_m * Eigen::Vector3d(block.key.x, block.key.y, block.key.z);
    return {low, low.array() + edge_m};
  }

  // `margin_m` = 0: all that is in the block; else what is so near around it, where nothing is yet.
  void Pour(int64_t number, double margin_m) {
    const VoxelBlock& block = blocks_.block(number);
    const std::optional<Pose3d>& move = moves_[static_cast<size_t>(number)];
    if (!move.has_value()) return Copy(block);
    const Box3d old_box(BoxOf(block).min().array() - margin_m,
                        BoxOf(block).max().array() + margin_m);
    const Box3d new_box = TransformBox(*move, old_box);
    const Pose3d old_T_new = move->Inverse();
    const Eigen::Vector3i low = blocks_.VoxelOf(new_box.min());
    const Eigen::Vector3i high = blocks_.VoxelOf(new_box.max());
    Eigen::Vector3i voxel;
    for (voxel.z() = low.z(); voxel.z() <= high.z(); ++voxel.z()) {
      for (voxel.y() = low.y(); voxel.y() <= high.y(); ++voxel.y()) {
        for (voxel.x() = low.x(); voxel.x() <= high.x(); ++voxel.x()) {
          const Eigen::Vector3d center = (voxel.cast<double>().array() + 0.5) * voxel_m_;
          const Eigen::Vector3d old_point = old_T_new * center;
          if (!IsWithin(old_box, old_point)) continue;
          const std::optional<Sample> sample = sampler_.At(old_point);
          if (sample.has_value()) Write(voxel, *sample, block, margin_m > 0.0);
        }
      }
    }
  }

  // Half open, so that a point on the face between two blocks is in one of them.
  static bool IsWithin(const Box3d& box, const Eigen::Vector3d& point) {
    return (point.array() >= box.min().array()).all() && (point.array() < box.max().array()).all();
  }

  void Copy(const VoxelBlock& block) {
    for (int i = 0; i < VoxelBlock::kCount; ++i) {
      const Sample sample{block.voxels[static_cast<size_t>(i)].distance_m, &block, i};
      if (!sample.voxel().IsSeen()) continue;
      constexpr int kSide = VoxelBlock::kSide;
      const Eigen::Vector3i in_block(i % kSide, i / kSide % kSide, i / (kSide * kSide));
      const Eigen::Vector3i key(block.key.x, block.key.y, block.key.z);
      Write(kSide * key + in_block, sample, block, /*is_filling=*/false);
    }
  }

  void Write(const Eigen::Vector3i& voxel, const Sample& sample, const VoxelBlock& from,
             bool is_filling) {
    VoxelBlock* block = BlockAt(BlockMap::KeyOf(voxel));
    const int index = BlockMap::IndexOf(voxel);
    Voxel& target = block->voxels[static_cast<size_t>(index)];
    if (is_filling && target.IsSeen()) return;
    TakeTimes(from, block);
    const VoxelLabels* labels = sample.block->LabelsOf(sample.index);
    if (!target.IsSeen()) {
      target = sample.voxel();
      target.distance_m = sample.distance_m;
      target.published = Voxel().published;
      if (labels != nullptr) *block->MakeLabels(index) = *labels;
      return;
    }
    const Voxel& other = sample.voxel();
    const bool is_other_surer = other.weight > target.weight;
    const float total = target.weight + other.weight;
    target.distance_m += (sample.distance_m - target.distance_m) * (other.weight / total);
    target.weight = std::max(target.weight, other.weight);
    if (is_other_surer && other.color_count > 0) {
      target.rgb = other.rgb;
      target.color_count = other.color_count;
    }
    const bool has_labels = block->LabelsOf(index) != nullptr;
    if (labels != nullptr && (is_other_surer || !has_labels)) *block->MakeLabels(index) = *labels;
  }

  static void TakeTimes(const VoxelBlock& from, VoxelBlock* to) {
    to->first_seen_ns = std::min(to->first_seen_ns, from.first_seen_ns);
    to->last_seen_ns = std::max(to->last_seen_ns, from.last_seen_ns);
    to->first_surface_ns = std::min(to->first_surface_ns, from.first_surface_ns);
    to->last_surface_ns = std::max(to->last_surface_ns, from.last_surface_ns);
    to->has_surface = to->has_surface || from.has_surface;
  }

  VoxelBlock* BlockAt(const BlockKey& key) {
    if (last_ != nullptr && last_->key == key) return last_;
    last_ = moved_.Find(key);
    if (last_ != nullptr) return last_;
    auto block = std::make_unique<VoxelBlock>();
    block->key = key;
    last_ = block.get();
    moved_.Insert(std::move(block));
    return last_;
  }

  const BlockMap& blocks_;
  double voxel_m_;
  BlockMap moved_;
  Sampler sampler_;
  /// By number of the block: new map frame from old map frame.
  std::vector<std::optional<Pose3d>> moves_;
  VoxelBlock* last_ = nullptr;
};

}  // namespace

BlockMap MoveBlocks(const BlockMap& blocks, const TrajectoryChange& change) {
  return Mover(blocks, change).Move();
}

}  // namespace dsg::ingest
