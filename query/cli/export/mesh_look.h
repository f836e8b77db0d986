// SPDX-License-Identifier: Apache-2.0
// What a mesh shows per vertex: its colour by choice, and a normal also where none was stored.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg::cli {

enum class MeshColor {
  /// kRgb if any block has colours, otherwise kLabel.
  kAuto,
  kRgb,
  kLabel,
  kInstance,
};

/// Never kAuto.
MeshColor SettleColor(const std::vector<MeshBlock>& mesh, MeshColor asked);

/// 0xRRGGBB of one vertex; grey where its block lacks the channel. Requires: `color` is not kAuto.
uint32_t VertexColor(const MeshBlock& block, size_t vertex, MeshColor color);

/// Unit normals: those stored, or else the mean of the faces around, weighted by area; up where
/// neither says anything.
std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block);

struct MeshCounts {
  size_t vertices = 0;
  size_t faces = 0;
};
MeshCounts CountMesh(const std::vector<MeshBlock>& mesh);

}  // namespace dsg::cli
