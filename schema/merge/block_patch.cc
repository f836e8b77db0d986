// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/block_patch.h"

#include <algorithm>

#include "schema/merge/block_span.h"

namespace dsg::merge {
namespace {

constexpr int kNotLooked = -2;
constexpr uint32_t kGrey = 0x808080;

uint32_t Mapped(const std::map<uint32_t, uint32_t>& numbers, uint32_t theirs) {
  const auto found = numbers.find(theirs);
  return found == numbers.end() ? 0 : found->second;
}

}  // namespace

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
  constexpr float kSameM = 1e-4f;
  // Faces that begin in a block reach out of it by a voxel.
  constexpr double kReachM = 0.2;
  const Box3d box = BoxOf(block_.index, block_size_m_);
  const Box3d around(box.min().array() - kReachM, box.max().array() + kReachM);
  for (size_t i = 0; i < source->on.size(); ++i) {
    const Eigen::Vector3f& position = source->block.positions_map[i];
    if (!around.contains(position.cast<double>()) || !IsOnSurface(i, source)) continue;
    const size_t mine = static_cast<size_t>(source->on[i]);
    if (mine >= known_count_) continue;
    if ((block_.positions_map[mine] - position).norm() < kSameM) is_copy_[mine] = 1;
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

// Channels that one of both has are filled for the other, but for times: none is better than a
// wrong one.
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

// The surface was seen again: it may be known now whose it is, and when it was seen last.
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

}  // namespace dsg::merge
