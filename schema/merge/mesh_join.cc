// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/mesh_join.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "schema/base/status.h"
#include "schema/merge/block_cache.h"
#include "schema/merge/block_patch.h"
#include "schema/merge/block_span.h"
#include "schema/merge/surface_index.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

constexpr size_t kCachedBlocks = 96;

}  // namespace

class MeshJoin::Impl {
 public:
  Impl(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
       const Pose3d& map_T_other, MeshIds ids, const MeshJoinOptions& options)
      : into_(into),
        other_(other),
        map_T_other_(map_T_other),
        ids_(std::move(ids)),
        options_(options),
        mine_(std::move(into), Pose3d(), kCachedBlocks),
        theirs_(std::move(other), map_T_other, kCachedBlocks) {}

  absl::StatusOr<std::optional<MeshBlock>> Next(const StopCheck& stop) {
    if (!is_listed_) DSG_RETURN_IF_ERROR(List());
    while (next_ != sources_of_.end()) {
      DSG_RETURN_IF_ERROR(AskStop(stop));
      DSG_ASSIGN_OR_RETURN(std::optional<MeshBlock> block, Join(next_->first, next_->second));
      ++next_;
      ++done_count_;
      if (block.has_value()) return block;
    }
    return std::optional<MeshBlock>();
  }

  absl::Status Follow(const std::shared_ptr<const Snapshot>& head,
                      const std::vector<BlockIndex>& touched) {
    if (touched.empty()) return absl::OkStatus();
    if (!is_listed_) DSG_RETURN_IF_ERROR(List());
    DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> there, head->MeshBlocks());
    for (const BlockIndex& index : touched) {
      mine_.ReadAnew(index, head);
      if (std::binary_search(there.begin(), there.end(), index)) {
        known_.insert(index);
      } else {
        known_.erase(index);
      }
    }
    return absl::OkStatus();
  }

  double progress() const {
    if (!is_listed_) return 0.0;
    if (sources_of_.empty()) return 1.0;
    return static_cast<double>(done_count_) / static_cast<double>(sources_of_.size());
  }
  int64_t fused_block_count() const { return fused_block_count_; }
  int64_t face_count() const { return face_count_; }
  int64_t dropped_face_count() const { return dropped_face_count_; }

 private:
  // Which blocks of the other map may have faces in each block of this one.
  absl::Status List() {
    DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> mine, into_->MeshBlocks());
    known_.insert(mine.begin(), mine.end());
    DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> theirs, other_->MeshBlocks());
    for (const BlockIndex source : theirs) {
      Box3d box = TransformBox(map_T_other_, BoxOf(source, other_->spec().mesh_block_size_m));
      box = Box3d(box.min().array() - 1e-3, box.max().array() + 1e-3);
      for (const BlockIndex target : BlocksIn(box, into_->spec().mesh_block_size_m)) {
        sources_of_[target].push_back(source);
      }
    }
    next_ = sources_of_.begin();
    is_listed_ = true;
    return absl::OkStatus();
  }

  // Bounds of a turned block are wider than the block, so most that it may touch it does not.
  absl::StatusOr<bool> IsTouched(BlockIndex target, const std::vector<BlockIndex>& sources) {
    for (const BlockIndex source : sources) {
      DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshBlock> block, theirs_.Read(source));
      for (const Eigen::Vector3f& position : block->positions_map) {
        if (BlockOf(position, into_->spec().mesh_block_size_m) == target) return true;
      }
    }
    return false;
  }

  // The surface of this map in and around a block; its own vertices come first.
  absl::StatusOr<SurfaceIndex> SurfaceAround(BlockIndex target, const MeshBlock& known) {
    std::vector<SurfacePoint> points;
    AppendSurface(known, Box3d(), &points);
    const double reach = options_.near_m + options_.along_m;
    const Box3d box = BoxOf(target, into_->spec().mesh_block_size_m);
    const Box3d wide(box.min().array() - reach, box.max().array() + reach);
    for (const BlockIndex near : BlocksIn(wide, into_->spec().mesh_block_size_m)) {
      if (near == target || !known_.contains(near)) continue;
      DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshBlock> block, mine_.Read(near));
      AppendSurface(*block, wide, &points);
    }
    return SurfaceIndex(std::move(points), options_);
  }

  static void AppendSurface(const MeshBlock& block, const Box3d& within,
                            std::vector<SurfacePoint>* points) {
    const std::vector<Eigen::Vector3f> normals = NormalsOf(block);
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3d position = block.positions_map[i].cast<double>();
      if (!within.isEmpty() && !within.contains(position)) continue;
      points->push_back({position, normals[i].cast<double>()});
    }
  }

  absl::StatusOr<std::optional<MeshBlock>> Join(BlockIndex target,
                                                const std::vector<BlockIndex>& sources) {
    DSG_ASSIGN_OR_RETURN(const bool is_touched, IsTouched(target, sources));
    if (!is_touched) return std::optional<MeshBlock>();
    MeshBlock known;
    known.index = target;
    const bool is_known = known_.contains(target);
    if (is_known) {
      DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshBlock> block, mine_.Read(target));
      known = *block;
    }
    DSG_ASSIGN_OR_RETURN(const SurfaceIndex surface, SurfaceAround(target, known));
    BlockPatch patch(std::move(known), into_->spec().mesh_block_size_m, ids_, surface);
    std::vector<std::shared_ptr<const MeshBlock>> blocks;
    for (const BlockIndex source : sources) {
      DSG_ASSIGN_OR_RETURN(std::shared_ptr<const MeshBlock> block, theirs_.Read(source));
      blocks.push_back(std::move(block));
    }
    patch.Add(blocks);
    face_count_ += patch.face_count();
    dropped_face_count_ += patch.dropped_face_count();
    if (is_known && patch.face_count() > 0) ++fused_block_count_;
    if (!patch.is_changed()) return std::optional<MeshBlock>();
    return std::optional<MeshBlock>(std::move(patch).Take());
  }

  std::shared_ptr<const Snapshot> into_;
  std::shared_ptr<const Snapshot> other_;
  Pose3d map_T_other_;
  MeshIds ids_;
  MeshJoinOptions options_;
  BlockCache mine_;
  BlockCache theirs_;
  bool is_listed_ = false;
  std::set<BlockIndex> known_;
  std::map<BlockIndex, std::vector<BlockIndex>> sources_of_;
  std::map<BlockIndex, std::vector<BlockIndex>>::iterator next_;
  int64_t done_count_ = 0;
  int64_t fused_block_count_ = 0;
  int64_t face_count_ = 0;
  int64_t dropped_face_count_ = 0;
};

MeshJoin::MeshJoin(std::shared_ptr<const Snapshot> into, std::shared_ptr<const Snapshot> other,
                   const Pose3d& map_T_other, MeshIds ids, const MeshJoinOptions& options)
    : impl_(std::make_unique<Impl>(std::move(into), std::move(other), map_T_other, std::move(ids),
                                   options)) {}
MeshJoin::~MeshJoin() = default;

absl::StatusOr<std::optional<MeshBlock>> MeshJoin::Next(const StopCheck& stop) {
  return impl_->Next(stop);
}
absl::Status MeshJoin::Follow(const std::shared_ptr<const Snapshot>& head,
                              const std::vector<BlockIndex>& touched) {
  return impl_->Follow(head, touched);
}
double MeshJoin::progress() const { return impl_->progress(); }
int64_t MeshJoin::fused_block_count() const { return impl_->fused_block_count(); }
int64_t MeshJoin::face_count() const { return impl_->face_count(); }
int64_t MeshJoin::dropped_face_count() const { return impl_->dropped_face_count(); }

}  // namespace dsg::merge
