// SPDX-License-Identifier: Apache-2.0
// Meshes of boxes for tests of the evaluation. Refuses rounded corners.
#pragma once

#include <array>
#include <cstdint>

#include "schema/model/geometry.h"
#include "schema/model/mesh.h"

namespace dsg::test {

inline constexpr uint32_t kWall = 1;
inline constexpr uint32_t kFloor = 2;

/// Two triangles a, b, c, d with a label; vertices of their own.
inline void AddQuad(const std::array<Eigen::Vector3f, 4>& corners, uint32_t label,
                    MeshBlock* mesh) {
  const auto base = static_cast<uint32_t>(mesh->positions_map.size());
  for (const Eigen::Vector3f& corner : corners) {
    mesh->positions_map.push_back(corner);
    mesh->labels.push_back(label);
    mesh->instance_ids.push_back(label << 8 | 1);
  }
  mesh->faces.push_back({base, base + 1, base + 2});
  mesh->faces.push_back({base, base + 2, base + 3});
}

/// The six sides of a box, axis aligned; the lowest gets `floor_label`.
inline void AddBox(const Box3d& box, uint32_t label, uint32_t floor_label, MeshBlock* mesh) {
  const Eigen::Vector3f low = box.min().cast<float>();
  const Eigen::Vector3f high = box.max().cast<float>();
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const float at : {low[axis], high[axis]}) {
      std::array<Eigen::Vector3f, 4> quad;
      for (int i = 0; i < 4; ++i) {
        quad[static_cast<size_t>(i)][axis] = at;
        quad[static_cast<size_t>(i)][u] = i == 0 || i == 3 ? low[u] : high[u];
        quad[static_cast<size_t>(i)][v] = i < 2 ? low[v] : high[v];
      }
      AddQuad(quad, axis == 2 && at == low[2] ? floor_label : label, mesh);
    }
  }
}

}  // namespace dsg::test
