// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/wire.h"

namespace dsg {
namespace {

// Floor, ceiling, and a vertical line at each corner.
Wire PrismWire(const RegionInfo& region) {
  Wire wire;
  const auto count = static_cast<uint32_t>(region.footprint_map.size());
  for (uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector2d& corner = region.footprint_map[i];
    const uint32_t next = i + 1 == count ? 0 : i + 1;
    wire.points.emplace_back(corner.x(), corner.y(), region.z_min_m);
    wire.points.emplace_back(corner.x(), corner.y(), region.z_max_m);
    wire.lines.push_back({2 * i, 2 * next});
    wire.lines.push_back({2 * i + 1, 2 * next + 1});
    wire.lines.push_back({2 * i, 2 * i + 1});
  }
  return wire;
}

}  // namespace

std::array<Eigen::Vector3d, 8> BoxCorners(const Node& node) {
  std::array<Eigen::Vector3d, 8> corners;
  const Box3d& box = node.box_node;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1 ? box.max() : box.min()).x(),
                                 (i & 2 ? box.max() : box.min()).y(),
                                 (i & 4 ? box.max() : box.min()).z());
    corners[static_cast<size_t>(i)] = node.map_T_node * corner;
  }
  return corners;
}

Wire WireOf(const Node& node) {
  if (node.region.has_value() && node.region->footprint_map.size() >= 3) {
    return PrismWire(*node.region);
  }
  Wire wire;
  if (node.box_node.isEmpty()) return wire;
  const std::array<Eigen::Vector3d, 8> corners = BoxCorners(node);
  wire.points.assign(corners.begin(), corners.end());
  for (uint32_t corner = 0; corner < corners.size(); ++corner) {
    for (const uint32_t axis : {1u, 2u, 4u}) {
      if ((corner & axis) == 0) wire.lines.push_back({corner, corner | axis});
    }
  }
  return wire;
}

}  // namespace dsg
