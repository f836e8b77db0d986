// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/mesh_join.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "schema/base/status.h"
#include "schema/merge/mesh_surface.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

constexpr size_t kJoinCachedBlocks = 96;

constexpr int kNotLooked = -2;
constexpr uint32_t kGrey = 0x808080;

uint32_t Mapped(const std::map<uint32_t, uint32_t>& numbers, uint32_t theirs) {
  const auto found = numbers.find(theirs);
  return found == numbers.end() ? 0 : found->second;
}

// One mesh block and the additions of the other map.
class BlockPatch {
 public:
  /// The first points of `surface` are the vertices of `known`. The arguments must outlive this.
  BlockPatch(MeshBlock known, double block_size_m, const MeshIds& ids, const SurfaceIndex& surface);

  /// Adds faces that begin in this block, and vertices in it without faces, from `sources`: blocks
  /// of the other map in the frame of this one. Call once.
  void Add(const std::vector<std::shared_ptr<const MeshBlock>>& sources);

  bool is_changed() const { return is_changed_; }
  int64_t face_count() const { return face_count_; }
  int64_t dropped_face_count() const { return dropped_face_count_; }
  MeshBlock Take() && { return std::move(block_); }

 private:
  struct Source {
    const MeshBlock& block;
    std::vector<Eigen::Vector3f> normals;
    /// By vertex: kNotLooked, -1 for no surface, or the index of its surface point.
    std::vector<int> on;
    /// By vertex: its index in the patch, -1 without one.
    std::vector<int> copied;
  };

  /// Marks vertices here that an earlier merge copied from `source`: the surface near them is no
  /// new observation.
  void NoteCopies(Source* source);
  void AddFaces(Source* source);
  bool IsInside(const Eigen::Vector3f& position) const;
  bool IsOnSurface(size_t vertex, Source* source) const;
  uint32_t Copy(size_t vertex, Source* source);
  void MarkSeen(size_t vertex, const Source& source);
  void MatchChannels(const MeshBlock& source);

  MeshBlock block_;
  size_t known_count_;
  double block_size_m_;
  const MeshIds& ids_;
  const SurfaceIndex& surface_;
  std::vector<char> is_copy_;
  bool is_changed_ = false;
  int64_t face_count_ = 0;
  int64_t dropped_face_count_ = 0;
};

BlockPatch::BlockPatch(MeshBlock known, double block_size_m, const MeshIds& ids,
                       const SurfaceIndex& surface)
    : block_(std::move(known)),
      known_count_(block_.positions_map.size()),
      block_size_m_(block_size_m),
      ids_(ids),
      surface_(surface) {}

bool BlockPatch::IsInside(const Eigen::Vector3f& position) const {
  return BlockOf(position, block_size_m_) == block_.index;
}

bool BlockPatch::IsOnSurface(size_t vertex, Source* source) const {
  int& on = source->on[vertex];
  if (on == kNotLooked) {
    on = surface_.Find({source->block.positions_map[vertex].cast<double>(),
                        source->normals[vertex].cast<double>()});
  }
  return on >= 0;
}

void BlockPatch::Add(const std::vector<std::shared_ptr<const MeshBlock>>& blocks) {
  std::vector<Source> sources;
  sources.reserve(blocks.size());
  for (const auto& block : blocks) {
    const size_t count = block->positions_map.size();
    sources.push_back({*block, NormalsOf(*block), std::vector<int>(count, kNotLooked),
                       std::vector<int>(count, -1)});
  }
  is_copy_.assign(known_count_, 0);
  for (Source& source : sources) NoteCopies(&source);
  for (Source& source : sources) AddFaces(&source);
}

void BlockPatch::NoteCopies(Source* source) {
  constexpr float kSameVertexM = 1e-4f;
  // Faces that begin in a block reach out of it by a voxel.
  constexpr double kReachM = 0.2;
  const Box3d box = BoxOf(block_.index, block_size_m_);
  const Box3d around(box.min().array() - kReachM, box.max().array() + kReachM);
  for (size_t i = 0; i < source->on.size(); ++i) {
    const Eigen::Vector3f& position = source->block.positions_map[i];
    if (!around.contains(position.cast<double>()) || !IsOnSurface(i, source)) continue;
    const size_t mine = static_cast<size_t>(source->on[i]);
    if (mine >= known_count_) continue;
    if ((block_.positions_map[mine] - position).norm() < kSameVertexM) is_copy_[mine] = 1;
  }
}

void BlockPatch::AddFaces(Source* source) {
  const MeshBlock& block = source->block;
  const size_t count = block.positions_map.size();
  std::vector<char> has_face(count, 0);
  bool is_begun = false;
  for (const auto& face : block.faces) {
    for (const uint32_t corner : face) has_face[corner] = 1;
    if (!IsInside(block.positions_map[face[0]])) continue;
    ++face_count_;
    bool is_known = true;
    for (const uint32_t corner : face) is_known &= IsOnSurface(corner, source);
    if (is_known) {
      ++dropped_face_count_;
      for (const uint32_t corner : face) MarkSeen(corner, *source);
      continue;
    }
    if (!is_begun) MatchChannels(block);
    is_begun = true;
    block_.faces.push_back({Copy(face[0], source), Copy(face[1], source), Copy(face[2], source)});
  }
  for (size_t i = 0; i < count; ++i) {
    if (has_face[i] != 0 || !IsInside(block.positions_map[i]) || IsOnSurface(i, source)) continue;
    if (!is_begun) MatchChannels(block);
    is_begun = true;
    Copy(i, source);
  }
}

uint32_t BlockPatch::Copy(size_t vertex, Source* source) {
  int& copied = source->copied[vertex];
  if (copied >= 0) return static_cast<uint32_t>(copied);
  const MeshBlock& from = source->block;
  copied = static_cast<int>(block_.positions_map.size());
  is_changed_ = true;
  block_.positions_map.push_back(from.positions_map[vertex]);
  if (!block_.normals_map.empty() || copied == 0) {
    block_.normals_map.push_back(source->normals[vertex]);
  }
  if (!block_.colors.empty() || (copied == 0 && !from.colors.empty())) {
    block_.colors.push_back(from.colors.empty() ? kGrey : from.colors[vertex]);
  }
  if (!block_.labels.empty() || (copied == 0 && !from.labels.empty())) {
    block_.labels.push_back(from.labels.empty() ? 0 : Mapped(ids_.label_of, from.labels[vertex]));
  }
  if (!block_.instance_ids.empty() || (copied == 0 && !from.instance_ids.empty())) {
    block_.instance_ids.push_back(
        from.instance_ids.empty() ? 0 : Mapped(ids_.instance_of, from.instance_ids[vertex]));
  }
  if (!block_.first_seen_ns.empty() || (copied == 0 && !from.first_seen_ns.empty())) {
    block_.first_seen_ns.push_back(from.first_seen_ns[vertex]);
  }
  if (!block_.last_seen_ns.empty() || (copied == 0 && !from.last_seen_ns.empty())) {
    block_.last_seen_ns.push_back(from.last_seen_ns[vertex]);
  }
  return static_cast<uint32_t>(copied);
}

// Fills channels that only one of both has, except times: no time is better than a wrong one.
void BlockPatch::MatchChannels(const MeshBlock& source) {
  const size_t count = block_.positions_map.size();
  if (count == 0) return;
  if (block_.normals_map.empty()) block_.normals_map = NormalsOf(block_);
  if (block_.colors.empty() && !source.colors.empty()) block_.colors.assign(count, kGrey);
  if (block_.labels.empty() && !source.labels.empty()) block_.labels.assign(count, 0);
  if (block_.instance_ids.empty() && !source.instance_ids.empty()) {
    block_.instance_ids.assign(count, 0);
  }
  if (source.first_seen_ns.empty()) block_.first_seen_ns.clear();
  if (source.last_seen_ns.empty()) block_.last_seen_ns.clear();
}

// The surface was seen again: updates its instance and its last observation.
void BlockPatch::MarkSeen(size_t vertex, const Source& source) {
  const size_t mine = static_cast<size_t>(source.on[vertex]);
  if (mine >= known_count_ || is_copy_[mine] != 0) return;
  const MeshBlock& from = source.block;
  if (!from.last_seen_ns.empty() && !block_.last_seen_ns.empty() &&
      from.last_seen_ns[vertex] > block_.last_seen_ns[mine]) {
    block_.last_seen_ns[mine] = from.last_seen_ns[vertex];
    is_changed_ = true;
  }
  if (from.instance_ids.empty() || block_.instance_ids.empty()) return;
  if (block_.instance_ids[mine] != 0) return;
  const uint32_t instance = Mapped(ids_.instance_of, from.instance_ids[vertex]);
  if (instance == 0) return;
  block_.instance_ids[mine] = instance;
  is_changed_ = true;
}

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
        mine_(std::move(into), Pose3d(), kJoinCachedBlocks),
        theirs_(std::move(other), map_T_other, kJoinCachedBlocks) {}

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

  // The bounds of a rotated block exceed the block, so it does not touch most of the listed ones.
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
