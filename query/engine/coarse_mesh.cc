// SPDX-License-Identifier: Apache-2.0
#include "query/engine/coarse_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"

namespace dsg::query {
namespace {

using Cell = std::array<int64_t, 3>;

// What becomes one vertex.
struct Cluster {
  int count = 0;
  // The first of its vertices.
  uint32_t first = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  TimeNs first_seen_ns = kTimeMax;
  TimeNs last_seen_ns = kTimeMin;
};

Eigen::Vector3d ChannelsOf(uint32_t color) {
  return {static_cast<double>(color >> 16 & 0xff), static_cast<double>(color >> 8 & 0xff),
          static_cast<double>(color & 0xff)};
}

uint32_t ColorOf(const Eigen::Vector3d& channels) {
  uint32_t color = 0;
  for (const double channel : channels) color = color << 8 | static_cast<uint32_t>(channel + 0.5);
  return color;
}

class Coarsening {
 public:
  Coarsening(const MeshBlock& block, double cell_m) : block_(block), cell_m_(cell_m) {
    for (uint32_t i = 0; i < block.positions_map.size(); ++i) AddVertex(i);
  }

  MeshBlock Make() const {
    MeshBlock out;
    out.index = block_.index;
    for (const Cluster& cluster : clusters_) AddCluster(cluster, &out);
    absl::flat_hash_set<std::array<uint32_t, 3>> known;
    for (const std::array<uint32_t, 3>& face : block_.faces) {
      std::array<uint32_t, 3> moved = {of_vertex_[face[0]], of_vertex_[face[1]],
                                       of_vertex_[face[2]]};
      if (moved[0] == moved[1] || moved[1] == moved[2] || moved[2] == moved[0]) continue;
      // Turned so that the same face has the same numbers, and still looks to the same side.
      std::rotate(moved.begin(), std::min_element(moved.begin(), moved.end()), moved.end());
      if (known.insert(moved).second) out.faces.push_back(moved);
    }
    return out;
  }

 private:
  void AddVertex(uint32_t i) {
    const Eigen::Vector3d at = block_.positions_map[i].cast<double>();
    Cell cell;
    for (size_t axis = 0; axis < 3; ++axis) {
      cell[axis] = static_cast<int64_t>(std::floor(at[static_cast<int>(axis)] / cell_m_));
    }
    const auto [known, is_new] =
        of_cell_.try_emplace(cell, static_cast<uint32_t>(clusters_.size()));
    if (is_new) clusters_.push_back({.first = i});
    of_vertex_.push_back(known->second);
    Cluster& cluster = clusters_[known->second];
    ++cluster.count;
    cluster.position += at;
    if (!block_.normals_map.empty()) cluster.normal += block_.normals_map[i].cast<double>();
    if (!block_.colors.empty()) cluster.color += ChannelsOf(block_.colors[i]);
    if (!block_.first_seen_ns.empty()) {
      cluster.first_seen_ns = std::min(cluster.first_seen_ns, block_.first_seen_ns[i]);
    }
    if (!block_.last_seen_ns.empty()) {
      cluster.last_seen_ns = std::max(cluster.last_seen_ns, block_.last_seen_ns[i]);
    }
  }

  void AddCluster(const Cluster& cluster, MeshBlock* out) const {
    out->positions_map.push_back((cluster.position / cluster.count).cast<float>());
    if (!block_.normals_map.empty()) {
      // Of opposite sides of something thin nothing is left; any of them will do.
      const bool is_flat = cluster.normal.norm() < 1e-6;
      out->normals_map.push_back(is_flat ? block_.normals_map[cluster.first]
                                         : cluster.normal.normalized().cast<float>());
    }
    if (!block_.colors.empty()) out->colors.push_back(ColorOf(cluster.color / cluster.count));
    if (!block_.labels.empty()) out->labels.push_back(block_.labels[cluster.first]);
    if (!block_.instance_ids.empty()) {
      out->instance_ids.push_back(block_.instance_ids[cluster.first]);
    }
    if (!block_.first_seen_ns.empty()) out->first_seen_ns.push_back(cluster.first_seen_ns);
    if (!block_.last_seen_ns.empty()) out->last_seen_ns.push_back(cluster.last_seen_ns);
  }

  const MeshBlock& block_;
  const double cell_m_;
  absl::flat_hash_map<Cell, uint32_t> of_cell_;
  std::vector<Cluster> clusters_;
  // The cluster of each vertex.
  std::vector<uint32_t> of_vertex_;
};

}  // namespace

MeshBlock CoarsenBlock(const MeshBlock& block, double cell_m) {
  return Coarsening(block, cell_m).Make();
}

}  // namespace dsg::query
