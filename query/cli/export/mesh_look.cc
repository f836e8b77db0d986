// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/mesh_look.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "query/cli/export/palette.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kNoColorRgb = 0xb0b0b0;

std::vector<Eigen::Vector3f> SumOfFaces(const MeshBlock& block) {
  std::vector<Eigen::Vector3f> sums(block.positions_map.size(), Eigen::Vector3f::Zero());
  for (const auto& face : block.faces) {
    const Eigen::Vector3f& corner = block.positions_map[face[0]];
    const Eigen::Vector3f twice_area =
        (block.positions_map[face[1]] - corner).cross(block.positions_map[face[2]] - corner);
    for (const uint32_t vertex : face) sums[vertex] += twice_area;
  }
  return sums;
}

}  // namespace

MeshColor SettleColor(const std::vector<MeshBlock>& mesh, MeshColor asked) {
  if (asked != MeshColor::kAuto) return asked;
  const bool has_colors = std::any_of(mesh.begin(), mesh.end(),
                                      [](const MeshBlock& block) { return !block.colors.empty(); });
  return has_colors ? MeshColor::kRgb : MeshColor::kLabel;
}

uint32_t VertexColor(const MeshBlock& block, size_t vertex, MeshColor color) {
  if (color == MeshColor::kRgb) {
    return block.colors.empty() ? kNoColorRgb : block.colors[vertex] & 0xffffff;
  }
  const std::vector<uint32_t>& channel =
      color == MeshColor::kInstance ? block.instance_ids : block.labels;
  return channel.empty() ? kNoColorRgb : LabelColor(channel[vertex]);
}

std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block) {
  std::vector<Eigen::Vector3f> normals =
      block.normals_map.empty() ? SumOfFaces(block) : block.normals_map;
  for (Eigen::Vector3f& normal : normals) {
    const float length = normal.norm();
    const bool is_usable = std::isfinite(length) && length > 1e-20f;
    normal = is_usable ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitZ();
  }
  return normals;
}

MeshCounts CountMesh(const std::vector<MeshBlock>& mesh) {
  MeshCounts counts;
  for (const MeshBlock& block : mesh) {
    counts.vertices += block.positions_map.size();
    counts.faces += block.faces.size();
  }
  return counts;
}

}  // namespace dsg::cli
