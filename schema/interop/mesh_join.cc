// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/mesh_join.h"

#include <limits>
#include <map>
#include <tuple>

namespace dsg {
namespace {

// All that is written of a vertex.
using VertexKey = std::tuple<float, float, float, uint32_t, uint32_t, TimeNs, TimeNs>;

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

class Joiner {
 public:
  Joiner(const std::vector<MeshBlock>& blocks, double block_size_m)
      : blocks_(blocks), block_size_m_(block_size_m) {}

  MeshBlock Join() {
    FindChannels();
    index_of_.resize(blocks_.size());
    for (size_t i = 0; i < blocks_.size(); ++i) ListCopies(i);
    // Own vertices first, so that copies in earlier blocks find them.
    for (size_t i = 0; i < blocks_.size(); ++i) AddOwn(i);
    for (size_t i = 0; i < blocks_.size(); ++i) AddCopies(i);
    for (size_t i = 0; i < blocks_.size(); ++i) {
      for (const auto& face : blocks_[i].faces) {
        whole_.faces.push_back(
            {index_of_[i][face[0]], index_of_[i][face[1]], index_of_[i][face[2]]});
      }
    }
    return std::move(whole_);
  }

 private:
  void FindChannels() {
    for (const MeshBlock& block : blocks_) {
      const size_t count = block.positions_map.size();
      if (count == 0) continue;
      has_colors_ = has_colors_ && block.colors.size() == count;
      has_labels_ = has_labels_ && block.labels.size() == count;
      has_first_ = has_first_ && block.first_seen_ns.size() == count;
      has_last_ = has_last_ && block.last_seen_ns.size() == count;
    }
  }

  bool IsOwn(size_t block, size_t vertex) const {
    return BlockOf(blocks_[block].positions_map[vertex], block_size_m_) == blocks_[block].index;
  }

  VertexKey KeyOf(const MeshBlock& block, size_t v) const {
    const Eigen::Vector3f& p = block.positions_map[v];
    return {p.x(),
            p.y(),
            p.z(),
            has_colors_ ? block.colors[v] : 0,
            has_labels_ ? block.labels[v] : 0,
            has_first_ ? block.first_seen_ns[v] : 0,
            has_last_ ? block.last_seen_ns[v] : 0};
  }

  uint32_t Add(const MeshBlock& block, size_t v) {
    whole_.positions_map.push_back(block.positions_map[v]);
    if (has_colors_) whole_.colors.push_back(block.colors[v]);
    if (has_labels_) whole_.labels.push_back(block.labels[v]);
    if (has_first_) whole_.first_seen_ns.push_back(block.first_seen_ns[v]);
    if (has_last_) whole_.last_seen_ns.push_back(block.last_seen_ns[v]);
    return static_cast<uint32_t>(whole_.positions_map.size() - 1);
  }

  void ListCopies(size_t i) {
    for (size_t v = 0; v < blocks_[i].positions_map.size(); ++v) {
      if (!IsOwn(i, v)) copies_.emplace(KeyOf(blocks_[i], v), kNone);
    }
  }

  void AddOwn(size_t i) {
    const MeshBlock& block = blocks_[i];
    index_of_[i].resize(block.positions_map.size());
    for (size_t v = 0; v < block.positions_map.size(); ++v) {
      if (!IsOwn(i, v)) continue;
      index_of_[i][v] = Add(block, v);
      const auto copied = copies_.find(KeyOf(block, v));
      if (copied != copies_.end() && copied->second == kNone) copied->second = index_of_[i][v];
    }
  }

  void AddCopies(size_t i) {
    const MeshBlock& block = blocks_[i];
    for (size_t v = 0; v < block.positions_map.size(); ++v) {
      if (IsOwn(i, v)) continue;
      uint32_t& number = copies_.at(KeyOf(block, v));
      if (number == kNone) number = Add(block, v);
      index_of_[i][v] = number;
    }
  }

  const std::vector<MeshBlock>& blocks_;
  const double block_size_m_;
  bool has_colors_ = true;
  bool has_labels_ = true;
  bool has_first_ = true;
  bool has_last_ = true;
  MeshBlock whole_;
  std::vector<std::vector<uint32_t>> index_of_;
  /// Only of vertices outside their block, which are few.
  std::map<VertexKey, uint32_t> copies_;
};

}  // namespace

MeshBlock JoinBlocks(const std::vector<MeshBlock>& blocks, double block_size_m) {
  return Joiner(blocks, block_size_m).Join();
}

}  // namespace dsg
