// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/block_map.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/volume/block_bytes.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Labels grow in small steps: doubling would waste half of them on average.
constexpr size_t kLabelStep = 48;

uint64_t Pack(const BlockKey& key) {
  constexpr uint64_t kMask = (uint64_t{1} << 21) - 1;
  return (static_cast<uint64_t>(key.x) & kMask) | (static_cast<uint64_t>(key.y) & kMask) << 21 |
         (static_cast<uint64_t>(key.z) & kMask) << 42;
}

}  // namespace

VoxelLabels* VoxelBlock::MakeLabels(int index) {
  if (label_index.empty()) label_index.assign(kCount, kNoLabels);
  uint16_t& place = label_index[index];
  if (place == kNoLabels) {
    place = static_cast<uint16_t>(labels.size());
    if (labels.size() == labels.capacity()) labels.reserve(labels.size() + kLabelStep);
    labels.emplace_back();
  }
  return &labels[place];
}

void VoxelBlock::Clear() {
  voxels.fill(Voxel());
  label_index.clear();
  labels.clear();
  first_seen_ns = first_surface_ns = kTimeMax;
  last_seen_ns = last_surface_ns = kTimeMin;
  updated = has_surface = queued = label_changed = false;
}

BlockMap::BlockMap(double voxel_m, const SpillOptions& spill)
    : voxel_m_(voxel_m),
      spill_(spill),
      resident_count_max_(static_cast<int64_t>(spill.resident_block_count)),
      file_(std::make_unique<SpillFile>(spill.folder)),
      loading_(std::make_unique<std::mutex>()) {}

VoxelBlock* BlockMap::Find(const BlockKey& key) const {
  const auto found = by_key_.find(Pack(key));
  return found == by_key_.end() ? nullptr : Use(found->second);
}

void BlockMap::Insert(std::unique_ptr<VoxelBlock> block) {
  auto slot = std::make_unique<Slot>();
  slot->key = block->key;
  slot->used = trim_count_;
  slot->block = std::move(block);
  const bool is_new = by_key_.emplace(Pack(slot->key), slot.get()).second;
  DSG_CHECK(is_new);
  slots_.push_back(std::move(slot));
  ++resident_count_;
}

void BlockMap::Load(Slot* slot) const {
  const std::lock_guard<std::mutex> lock(*loading_);
  if (slot->is_here.load(std::memory_order_relaxed)) return;
  auto block = std::make_unique<VoxelBlock>();
  std::string bytes;
  absl::Status read = file_->Read(slot->piece, &bytes);
  if (read.ok() && !DecodeBlock(bytes, block.get())) {
    read = absl::InternalError("a voxel block was written to disk in a form that is none");
  }
  if (!read.ok()) {
    block->Clear();
    status_.Update(read);
  }
  block->key = slot->key;
  slot->block = std::move(block);
  ++resident_count_;
  slot->is_here.store(true, std::memory_order_release);
}

absl::Status BlockMap::PutAway(Slot* slot) const {
  const VoxelBlock& block = *slot->block;
  const absl::Status written = file_->Write(EncodeBlock(block), &slot->piece);
  if (!written.ok()) {
    return Annotate(written,
                    absl::StrCat("the volume has ", size(), " blocks, ", resident_count_max_,
                                 " of which may be in memory (--resident-blocks)"));
  }
  slot->has_surface = block.has_surface;
  slot->states.fill(0);
  for (int i = 0; i < VoxelBlock::kCount; ++i) {
    const auto state = static_cast<unsigned>(StateOf(block.voxels[i]));
    slot->states[i / 4] = static_cast<uint8_t>(slot->states[i / 4] | state << i % 4 * 2);
  }
  slot->is_here.store(false, std::memory_order_relaxed);
  slot->block.reset();
  --resident_count_;
  return absl::OkStatus();
}

absl::Status BlockMap::Trim() const {
  ++trim_count_;
  if (!status_.ok() || !IsFull()) return status_;
  std::vector<Slot*> here;
  for (const std::unique_ptr<Slot>& slot : slots_) {
    if (slot->is_here.load(std::memory_order_relaxed)) here.push_back(slot.get());
  }
  // Some room, so that not each frame has to look for it.
  const int64_t kept_count = resident_count_max_ - resident_count_max_ / 8;
  const auto end = here.begin() + (resident_count_ - kept_count);
  const auto is_older = [](const Slot* a, const Slot* b) {
    const auto order = [](const Slot* slot) {
      return std::tuple(slot->used.load(std::memory_order_relaxed), slot->key);
    };
    return order(a) < order(b);
  };
  std::nth_element(here.begin(), end, here.end(), is_older);
  for (auto slot = here.begin(); slot != end; ++slot) {
    status_ = PutAway(*slot);
    if (!status_.ok()) break;
  }
  return status_;
}

VoxelState BlockMap::StateOf(const Voxel& voxel) const {
  if (!voxel.IsSeen()) return VoxelState::kUnseen;
  if (voxel.distance_m < 0.5f * static_cast<float>(voxel_m_)) return VoxelState::kInside;
  return static_cast<double>(voxel.distance_m) > voxel_m_ ? VoxelState::kFree : VoxelState::kNear;
}

VoxelState BlockMap::StateIn(const Slot& slot, int index) const {
  if (slot.is_here.load(std::memory_order_acquire)) return StateOf(slot.block->voxels[index]);
  return static_cast<VoxelState>(slot.states[index / 4] >> index % 4 * 2 & 3);
}

bool BlockMap::HasSurface(int64_t number) const {
  const Slot& slot = *slots_[number];
  const bool is_here = slot.is_here.load(std::memory_order_acquire);
  return is_here ? slot.block->has_surface : slot.has_surface;
}

BlockMap::States BlockMap::StatesOf(int64_t number) const {
  const Slot& slot = *slots_[number];
  const bool is_here = slot.is_here.load(std::memory_order_acquire);
  States states;
  for (int i = 0; i < VoxelBlock::kCount; ++i) {
    states[i] = is_here ? StateOf(slot.block->voxels[i]) : StateIn(slot, i);
  }
  return states;
}

VoxelState BlockMap::StateAt(const Eigen::Vector3d& point_map) const {
  const double bound_m = kKeyMax * VoxelBlock::kSide * voxel_m_;
  if (!(point_map.cwiseAbs().maxCoeff() < bound_m)) return VoxelState::kUnseen;
  const Eigen::Vector3i voxel = VoxelOf(point_map);
  const auto found = by_key_.find(Pack(KeyOf(voxel)));
  if (found == by_key_.end()) return VoxelState::kUnseen;
  return StateIn(*found->second, IndexOf(voxel));
}

}  // namespace dsg::ingest
