// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/topology.h"

#include <algorithm>

#include "schema/codec/bit_stream.h"

namespace dsg {
namespace {

constexpr size_t kFaceBytes = 12;

}  // namespace

std::string EncodeTopology(const Topology& topology) {
  std::string bytes;
  bytes.reserve(8 + topology.faces.size() * kFaceBytes);
  AppendFixed(topology.vertex_count, &bytes);
  AppendFixed(static_cast<uint32_t>(topology.faces.size()), &bytes);
  for (const auto& face : topology.faces) {
    for (const uint32_t vertex : face) AppendFixed(vertex, &bytes);
  }
  return bytes;
}

bool DecodeTopology(std::string_view bytes, Topology* topology) {
  ByteReader reader(bytes);
  topology->vertex_count = reader.Fixed<uint32_t>();
  const size_t face_count = reader.Fixed<uint32_t>();
  if (!reader.ok() || reader.remaining() != face_count * kFaceBytes) return false;
  topology->faces.clear();
  topology->faces.reserve(face_count);
  for (size_t i = 0; i < face_count; ++i) {
    std::array<uint32_t, 3> face{};
    for (uint32_t& vertex : face) vertex = reader.Fixed<uint32_t>();
    if (*std::max_element(face.begin(), face.end()) >= topology->vertex_count) return false;
    topology->faces.push_back(face);
  }
  return true;
}

}  // namespace dsg
