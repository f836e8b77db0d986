// SPDX-License-Identifier: Apache-2.0
// The metric-semantic mesh, in cubic blocks, and content-addressed assets.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/node.h"

namespace dsg {

/// The block covers [index, index + 1) x MapSpec::mesh_block_size_m on each axis of the map.
struct BlockIndex {
  int32_t x = 0;
  int32_t y = 0;
  int32_t z = 0;
  auto operator<=>(const BlockIndex&) const = default;
};

/// One block. Optional channels are either empty or as long as `positions`.
/// A face belongs to the block of its first vertex; vertices it shares with neighbours are
/// repeated in both.
struct MeshBlock {
  BlockIndex index;
  std::vector<Eigen::Vector3f> positions_map;
  std::vector<Eigen::Vector3f> normals_map;
  /// 0xRRGGBB.
  std::vector<uint32_t> colors;
  std::vector<uint32_t> labels;
  std::vector<uint32_t> instance_ids;
  std::vector<TimeNs> first_seen_ns;
  std::vector<TimeNs> last_seen_ns;
  /// Indices into this block's vertices.
  std::vector<std::array<uint32_t, 3>> faces;
};

/// The block that holds a point. Errors: none; requires |point / block_size| < 2^31.
BlockIndex BlockOf(const Eigen::Vector3f& point_map, double block_size_m);

/// Cuts a mesh of one piece into blocks, ascending by index. `whole.index` is ignored.
std::vector<MeshBlock> SplitIntoBlocks(const MeshBlock& whole, double block_size_m);

/// A CAD model, texture or topology, stored once and referred to by its hash.
struct Asset {
  Sha256 sha256{};
  std::string media_type;
  std::string content;
};

}  // namespace dsg
