// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "ingest/pipeline/map_mover.h"

namespace dsg::ingest {
namespace {

using Position = std::array<float, 3>;

// Which optional channels the whole mesh keeps: those that every block has.
struct Channels {
  bool has_normals = true;
  bool has_colors = true;
  bool has_labels = true;
  bool has_instances = true;
  bool has_times = true;
};

Channels ChannelsOf(const std::vector<const MeshBlock*>& mesh) {
  Channels channels;
  for (const MeshBlock* block : mesh) {
    if (block->positions_map.empty()) continue;
    channels.has_normals &= !block->normals_map.empty();
    channels.has_colors &= !block->colors.empty();
    channels.has_labels &= !block->labels.empty();
    channels.has_instances &= !block->instance_ids.empty();
    channels.has_times &= !block->first_seen_ns.empty() && !block->last_seen_ns.empty();
  }
  return channels;
}

// One mesh of many blocks, in which vertices that blocks repeat stand once: they would come apart
// where one block was made later than its neighbour and knows later times.
class WeldedMesh {
 public:
  explicit WeldedMesh(const Channels& channels) : channels_(channels) {}

  void Add(const MeshBlock& block) {
    std::vector<uint32_t> whole_of_local;
    whole_of_local.reserve(block.positions_map.size());
    for (size_t i = 0; i < block.positions_map.size(); ++i) {
      const Eigen::Vector3f& position = block.positions_map[i];
      const auto next = static_cast<uint32_t>(whole_.positions_map.size());
      const auto [entry, is_new] =
          index_of_.try_emplace({position.x(), position.y(), position.z()}, next);
      whole_of_local.push_back(entry->second);
      if (is_new) {
        AddVertex(block, i);
      } else if (channels_.has_times) {
        TimeNs& first_ns = whole_.first_seen_ns[entry->second];
        TimeNs& last_ns = whole_.last_seen_ns[entry->second];
        first_ns = std::min(first_ns, block.first_seen_ns[i]);
        last_ns = std::max(last_ns, block.last_seen_ns[i]);
      }
    }
    for (const auto& [a, b, c] : block.faces) {
      const std::array<uint32_t, 3> face = {whole_of_local[a], whole_of_local[b],
                                            whole_of_local[c]};
      if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
      whole_.faces.push_back(face);
    }
  }

  MeshBlock Take() { return std::move(whole_); }

 private:
  void AddVertex(const MeshBlock& block, size_t i) {
    whole_.positions_map.push_back(block.positions_map[i]);
    if (channels_.has_normals) whole_.normals_map.push_back(block.normals_map[i]);
    if (channels_.has_colors) whole_.colors.push_back(block.colors[i]);
    if (channels_.has_labels) whole_.labels.push_back(block.labels[i]);
    if (channels_.has_instances) whole_.instance_ids.push_back(block.instance_ids[i]);
    if (!channels_.has_times) return;
    whole_.first_seen_ns.push_back(block.first_seen_ns[i]);
    whole_.last_seen_ns.push_back(block.last_seen_ns[i]);
  }

  const Channels channels_;
  MeshBlock whole_;
  // Asked one by one, never walked through: its order is not the same everywhere.
  absl::flat_hash_map<Position, uint32_t> index_of_;
};

// Vertices of one frame share their stamps: most of them ask for the same few instants.
class ChangeTable {
 public:
  explicit ChangeTable(const TrajectoryChange& change) : change_(change) {}

  Pose3d At(TimeNs time_ns) {
    const auto [entry, is_new] = change_at_.try_emplace(time_ns);
    if (is_new) entry->second = change_.At(time_ns);
    return entry->second;
  }

 private:
  const TrajectoryChange& change_;
  absl::flat_hash_map<TimeNs, Pose3d> change_at_;
};

MapShift MoveVertices(const TrajectoryChange& change, MeshBlock* mesh) {
  MapShift shift;
  ChangeTable changes(change);
  const bool has_times = !mesh->first_seen_ns.empty();
  for (size_t i = 0; has_times && i < mesh->positions_map.size(); ++i) {
    const Eigen::Vector3d old_map = mesh->positions_map[i].cast<double>();
    const Pose3d by_first = changes.At(mesh->first_seen_ns[i]);
    const Pose3d by_last = changes.At(mesh->last_seen_ns[i]);
    const Eigen::Vector3d new_map = 0.5 * (by_first * old_map + by_last * old_map);
    const Eigen::Quaterniond turn = by_first.orientation.slerp(0.5, by_last.orientation);
    mesh->positions_map[i] = new_map.cast<float>();
    if (!mesh->normals_map.empty()) {
      mesh->normals_map[i] = (turn * mesh->normals_map[i].cast<double>()).cast<float>();
    }
    shift.Add(old_map, new_map, YawOf(turn));
  }
  return shift;
}

}  // namespace

MovedMesh MoveMesh(const std::vector<const MeshBlock*>& mesh, const TrajectoryChange& change,
                   double block_size_m) {
  MovedMesh moved;
  if (change.IsIdentity()) return moved;
  WeldedMesh welded(ChannelsOf(mesh));
  std::set<BlockIndex> old_blocks;
  for (const MeshBlock* block : mesh) {
    old_blocks.insert(block->index);
    welded.Add(*block);
  }
  MeshBlock whole = welded.Take();
  moved.shift = MoveVertices(change, &whole);
  moved.blocks = SplitIntoBlocks(whole, block_size_m);
  for (const MeshBlock& block : moved.blocks) old_blocks.erase(block.index);
  moved.removed.assign(old_blocks.begin(), old_blocks.end());
  return moved;
}

}  // namespace dsg::ingest
