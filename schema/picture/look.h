// SPDX-License-Identifier: Apache-2.0
// Colours of labels, classes, layers, relations and agents, the same in every file and picture;
// what a mesh shows per vertex.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "schema/model/mesh.h"
#include "schema/model/node.h"

namespace dsg {

// All colours are 0xRRGGBB.

/// Of pictures: the page, its letters, and walls.
inline constexpr uint32_t kPaperRgb = 0xfbfaf7;
inline constexpr uint32_t kInkRgb = 0x2b2f3a;
inline constexpr uint32_t kWallRgb = 0x3d4250;

/// Differs from the colours of neighbouring labels; 0 (unknown) is grey.
uint32_t LabelColor(uint32_t label);
/// By class id, or else by class name; grey without either.
uint32_t ClassColor(const Node& node);
/// A pale form, for the floors of rooms. Neighbours without a class differ.
uint32_t FloorColor(const Node& node);
/// A strong form of the same hue, for what is in the room.
uint32_t RoomColor(const Node& node);
/// That of the room that contains the place, if one does. `parents`: ParentsOf.
uint32_t PlaceColor(const Node& place, const std::unordered_map<NodeId, const Node*>& parents);
/// Of links between rooms. Source: RSS 2020, figure 2.
inline constexpr uint32_t kRoomLinkRgb = 0xd33a2c;
uint32_t LayerColor(LayerId layer);
uint32_t RelationColor(std::string_view relation);
/// The n-th agent of a map.
uint32_t AgentColor(size_t index);

enum class MeshColor {
  /// kRgb if any block has colours, otherwise kLabel.
  kAuto,
  kRgb,
  kLabel,
  kInstance,
};

/// Never kAuto.
MeshColor SettleColor(const std::vector<MeshBlock>& mesh, MeshColor asked);

/// Colour of one vertex; grey if its block lacks the channel. Requires: `color` is not kAuto.
uint32_t VertexColor(const MeshBlock& block, size_t vertex, MeshColor color);

/// Unit normals: the stored ones, or else the mean of the adjacent faces weighted by area; z
/// without either.
std::vector<Eigen::Vector3f> NormalsOf(const MeshBlock& block);

struct MeshCounts {
  size_t vertices = 0;
  size_t faces = 0;
};
MeshCounts CountMesh(const std::vector<MeshBlock>& mesh);

}  // namespace dsg
