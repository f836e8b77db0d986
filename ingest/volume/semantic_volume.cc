// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/semantic_volume.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "ingest/volume/block_integrator.h"
#include "ingest/volume/block_mesher.h"
#include "ingest/volume/block_search.h"
#include "ingest/volume/instance_matcher.h"
#include "ingest/volume/moved_blocks.h"
#include "ingest/volume/parallel.h"
#include "ingest/volume/published_field.h"
#include "ingest/volume/volume_occupancy.h"
#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

// Meshes between two looks at how many blocks are in memory.
constexpr size_t kMeshesAtOnce = 8;

// Says whether a mesh is the one already handed out. Colours are left out: they never settle.
class MeshDigest {
 public:
  static uint64_t Of(const MeshBlock& mesh) {
    MeshDigest digest;
    for (const Eigen::Vector3f& p : mesh.positions_map) digest.Add(p.data(), 3 * sizeof(float));
    digest.Add(mesh.labels.data(), mesh.labels.size() * sizeof(uint32_t));
    digest.Add(mesh.instance_ids.data(), mesh.instance_ids.size() * sizeof(uint32_t));
    digest.Add(mesh.faces.data(), mesh.faces.size() * sizeof(mesh.faces[0]));
    return digest.hash_;
  }

 private:
  // FNV-1a.
  void Add(const void* data, size_t size) {
    const auto* bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < size; ++i) hash_ = (hash_ ^ bytes[i]) * 1099511628211u;
  }
  uint64_t hash_ = 14695981039346656037u;
};

}  // namespace

class SemanticVolume::Impl {
 public:
  explicit Impl(const VolumeOptions& options)
      : options_(options),
        blocks_(options.voxel_m, options.spill),
        field_(blocks_, BandLengths(options), options.meshing),
        meaning_(options.label_confidence),
        matcher_(options.instances) {}

  const VolumeOptions& options() const { return options_; }
  VolumeCounts counts() const {
    VolumeCounts counts = counts_;
    counts.resident_block_count = blocks_.resident_count();
    return counts;
  }
  const absl::Status& status() const { return status_; }
  const BlockMap& blocks() const { return blocks_; }

  absl::Status Integrate(const DepthFrame& frame) {
    const absl::Status checked = FrameView::Check(frame, options_.voxel_m);
    if (!checked.ok()) return checked;
    if (!status_.ok()) return status_;
    const FrameView view(frame, options_);
    matcher_.Match(view, blocks_);
    std::vector<VoxelBlock*> due = CollectBlocks(view);
    const BlockIntegrator integrator(view, options_, matcher_.instance_of_label());
    ParallelFor(options_.thread_count, due.size(), [&](size_t i) { integrator.Integrate(due[i]); });
    for (VoxelBlock* block : due) {
      if (!block->updated) continue;
      block->first_seen_ns = std::min(block->first_seen_ns, frame.time_ns);
      block->last_seen_ns = std::max(block->last_seen_ns, frame.time_ns);
      if (!block->has_surface || block->queued) continue;
      block->queued = true;
      queue_.push_back(block->key);
    }
    KeepUpdated();
    ++counts_.frame_count;
    counts_.pixel_count += view.used_count();
    counts_.dynamic_pixel_count += view.dynamic_count();
    counts_.block_count = blocks_.size();
    Trim();
    return status_;
  }

  std::vector<MeshBlock> TakeChangedMesh(double block_size_m) {
    DSG_CHECK(block_size_m >= options_.voxel_m);
    for (const BlockKey& key : std::exchange(queue_, {})) {
      VoxelBlock* const block = blocks_.Find(key);
      block->queued = false;
      const std::optional<Eigen::AlignedBox3i> changed = field_.Publish(block);
      if (changed.has_value()) MarkVoxels(*changed, block_size_m);
      if (blocks_.IsFull()) Trim();
    }
    for (const Box3d& box : matcher_.TakeRenamedBoxes()) {
      MarkBox(box.min().array() - 4.0 * options_.voxel_m,
              box.max().array() + 4.0 * options_.voxel_m, block_size_m);
    }
    const std::set<BlockIndex> due = std::exchange(due_meshes_, {});
    const std::vector<BlockIndex> indices(due.begin(), due.end());
    std::vector<MeshBlock> meshes(indices.size());
    const size_t at_once = blocks_.IsLarge() ? kMeshesAtOnce : indices.size();
    for (size_t begin = 0; begin < indices.size(); begin += at_once) {
      const size_t count = std::min(at_once, indices.size() - begin);
      ParallelFor(options_.thread_count, count, [&](size_t i) {
        meshes[begin + i] = BlockMesher(blocks_, field_, meaning_, matcher_.book(), block_size_m)
                                .Make(indices[begin + i]);
      });
      Trim();
    }
    std::erase_if(meshes, [this](const MeshBlock& mesh) { return !IsNews(mesh); });
    return meshes;
  }

  void Move(const TrajectoryChange& change) {
    Replace(MoveBlocks(blocks_, change));
    for (int64_t i = 0; i < blocks_.size(); ++i) {
      if (!blocks_.HasSurface(i)) continue;
      blocks_.block(i).queued = true;
      queue_.push_back(blocks_.key(i));
      if (blocks_.IsFull()) Trim();
    }
    Trim();
  }

  void Clear() {
    Replace(blocks_.MakeEmpty());
    counts_ = {};
  }

  OccupancyGrid MakeOccupancy(double cell_m) {
    OccupancyGrid grid = MakeVolumeOccupancy(blocks_, cell_m);
    counts_.cut_block_count = CountBlocksOutside(blocks_, grid.frame);
    return grid;
  }

 private:
  // Pointers to blocks are void afterwards.
  void Replace(BlockMap blocks) {
    status_.Update(blocks_.status());
    blocks_ = std::move(blocks);
    matcher_.MoveTo(blocks_);
    counts_.block_count = blocks_.size();
    queue_.clear();
    // Meshes of before may have lost their surface.
    for (const auto& [index, digest] : digests_) due_meshes_.insert(index);
  }

  void Trim() {
    blocks_.Trim().IgnoreError();
    status_.Update(blocks_.status());
  }

  // Blocks of the map that the frame concerns, and fresh ones for those it has not got yet.
  std::vector<VoxelBlock*> CollectBlocks(const FrameView& view) {
    std::vector<VoxelBlock*> due;
    size_t fresh_count = 0;
    const int64_t room = options_.block_count_max - blocks_.size();
    for (const BlockKey& key : FindVisibleBlocks(view, options_, options_.block_count_max)) {
      if (VoxelBlock* block = blocks_.Find(key); block != nullptr) {
        due.push_back(block);
        continue;
      }
      if (static_cast<int64_t>(fresh_count) >= room) {
        ++counts_.refused_block_count;
        continue;
      }
      if (fresh_count == fresh_.size()) fresh_.push_back(std::make_unique<VoxelBlock>());
      fresh_[fresh_count]->key = key;
      due.push_back(fresh_[fresh_count].get());
      ++fresh_count;
    }
    used_fresh_count_ = fresh_count;
    return due;
  }

  // Fresh blocks that turned out to be hidden are kept for the next frame.
  void KeepUpdated() {
    std::vector<std::unique_ptr<VoxelBlock>> spare;
    for (size_t i = 0; i < fresh_.size(); ++i) {
      if (i < used_fresh_count_ && fresh_[i]->updated) {
        blocks_.Insert(std::move(fresh_[i]));
      } else {
        fresh_[i]->Clear();
        spare.push_back(std::move(fresh_[i]));
      }
    }
    fresh_ = std::move(spare);
  }

  // Vertices lie up to a voxel away from the voxels they come from.
  void MarkVoxels(const Eigen::AlignedBox3i& voxels, double block_size_m) {
    MarkBox((voxels.min().cast<double>().array() - 0.5) * options_.voxel_m,
            (voxels.max().cast<double>().array() + 1.5) * options_.voxel_m, block_size_m);
  }

  void MarkBox(const Eigen::Vector3d& low_map, const Eigen::Vector3d& high_map,
               double block_size_m) {
    const BlockIndex low = BlockOf(low_map.cast<float>(), block_size_m);
    const BlockIndex high = BlockOf(high_map.cast<float>(), block_size_m);
    BlockIndex index;
    for (index.x = low.x; index.x <= high.x; ++index.x) {
      for (index.y = low.y; index.y <= high.y; ++index.y) {
        for (index.z = low.z; index.z <= high.z; ++index.z) due_meshes_.insert(index);
      }
    }
  }

  bool IsNews(const MeshBlock& mesh) {
    const auto known = digests_.find(mesh.index);
    if (mesh.positions_map.empty()) {
      if (known == digests_.end()) return false;
      digests_.erase(known);
      return true;
    }
    const uint64_t digest = MeshDigest::Of(mesh);
    if (known != digests_.end() && known->second == digest) return false;
    digests_[mesh.index] = digest;
    return true;
  }

  VolumeOptions options_;
  BlockMap blocks_;
  PublishedField field_;
  VoxelMeaning meaning_;
  InstanceMatcher matcher_;
  VolumeCounts counts_;
  // Blocks made for the frame at hand; the first used_fresh_count_ of them are in use.
  std::vector<std::unique_ptr<VoxelBlock>> fresh_;
  size_t used_fresh_count_ = 0;
  // Blocks with a surface that have been written since the last mesh.
  std::vector<BlockKey> queue_;
  std::set<BlockIndex> due_meshes_;
  // Of the meshes handed out.
  std::map<BlockIndex, uint64_t> digests_;
  absl::Status status_;
};

SemanticVolume::SemanticVolume(const VolumeOptions& options)
    : impl_(std::make_unique<Impl>(options)) {
  DSG_CHECK(options.Validate().ok());
}
SemanticVolume::~SemanticVolume() = default;
SemanticVolume::SemanticVolume(SemanticVolume&&) noexcept = default;
SemanticVolume& SemanticVolume::operator=(SemanticVolume&&) noexcept = default;

const VolumeOptions& SemanticVolume::options() const { return impl_->options(); }
VolumeCounts SemanticVolume::counts() const { return impl_->counts(); }
const absl::Status& SemanticVolume::status() const { return impl_->status(); }

absl::Status SemanticVolume::Integrate(const DepthFrame& frame) { return impl_->Integrate(frame); }

std::vector<MeshBlock> SemanticVolume::TakeChangedMesh(double block_size_m) {
  return impl_->TakeChangedMesh(block_size_m);
}

void SemanticVolume::Move(const TrajectoryChange& change) { impl_->Move(change); }

void SemanticVolume::Clear() { impl_->Clear(); }

OccupancyGrid SemanticVolume::MakeOccupancy(double cell_m) { return impl_->MakeOccupancy(cell_m); }

Occupancy SemanticVolume::At(const Eigen::Vector3d& point_map) const {
  const VoxelState state = impl_->blocks().StateAt(point_map);
  if (state == VoxelState::kUnseen) return Occupancy::kUnknown;
  return state == VoxelState::kFree ? Occupancy::kFree : Occupancy::kOccupied;
}

}  // namespace dsg::ingest
