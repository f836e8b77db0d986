// SPDX-License-Identifier: Apache-2.0
// The faces that body meshes share: an asset of media type application/x-topology.
// Refuses faces of vertices that are not there.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dsg {

inline constexpr char kTopologyMediaType[] = "application/x-topology";

struct Topology {
  uint32_t vertex_count = 0;
  /// Indices of three vertices each, counterclockwise seen from outside.
  std::vector<std::array<uint32_t, 3>> faces;
  bool operator==(const Topology&) const = default;
};

/// Vertex count, face count, then three indices a face: 32-bit numbers, little-endian.
std::string EncodeTopology(const Topology& topology);
/// False if the bytes are not a topology.
bool DecodeTopology(std::string_view bytes, Topology* topology);

}  // namespace dsg
