// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/look.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "schema/model/edge.h"

namespace dsg {
namespace {

constexpr uint32_t kUnknownRgb = 0x9aa0a6;
// Steps of this share of the circle stay far from earlier ones.
constexpr double kGoldenPart = 0.618033988749895;

constexpr std::array<uint32_t, 12> kAgentRgb = {0xd1495b, 0x2274a5, 0x3c9d5f, 0xe08e1b,
                                                0x7b4fa3, 0x17a2a2, 0xb8457f, 0x6d7f1e,
                                                0x4c5bd4, 0xa4552b, 0x5a9bd5, 0x374151};

uint32_t FromHsv(double hue, double saturation, double value) {
  const auto channel = [&](double offset) {
    const double k = std::fmod(offset + 6.0 * hue, 6.0);
    const double part = std::clamp(std::min(k, 4.0 - k), 0.0, 1.0);
    return static_cast<uint32_t>(std::lround(255.0 * value * (1.0 - saturation * part)));
  };
  return channel(5.0) << 16 | channel(3.0) << 8 | channel(1.0);
}

double HueOf(uint32_t number) {
  return std::fmod(kGoldenPart * static_cast<double>(number) + 0.07, 1.0);
}

// FNV-1a: unlike std::hash, the same on every machine.
uint32_t HashOf(std::string_view text) {
  uint32_t hash = 2166136261u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return hash;
}

// A number for the class; 0 = none.
uint32_t ClassNumber(const Node& node) {
  if (node.class_id > 0) return static_cast<uint32_t>(node.class_id);
  if (!node.class_name.empty()) return 1 + HashOf(node.class_name) % 4093;
  return 0;
}

double RoomHue(const Node& node) {
  const uint32_t number = ClassNumber(node);
  return HueOf(number == 0 ? static_cast<uint32_t>(node.id.index() % 4093) : number);
}

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

uint32_t LabelColor(uint32_t label) {
  if (label == 0) return kUnknownRgb;
  // Three depths in turn separate labels with similar hues.
  constexpr std::array<double, 3> kValues = {0.85, 0.65, 0.95};
  constexpr std::array<double, 3> kSaturations = {0.65, 0.75, 0.45};
  return FromHsv(HueOf(label), kSaturations[label % 3], kValues[label % 3]);
}

uint32_t ClassColor(const Node& node) { return LabelColor(ClassNumber(node)); }

uint32_t FloorColor(const Node& node) { return FromHsv(RoomHue(node), 0.13, 0.95); }

uint32_t RoomColor(const Node& node) { return FromHsv(RoomHue(node), 0.75, 0.72); }

uint32_t PlaceColor(const Node& place, const std::unordered_map<NodeId, const Node*>& parents) {
  const auto parent = parents.find(place.id);
  const bool has_room = parent != parents.end() && parent->second->kind == kinds::kRoom;
  return has_room ? RoomColor(*parent->second) : LayerColor(layers::kPlaces);
}

uint32_t LayerColor(LayerId layer) {
  switch (layer) {
    case layers::kObjects:
      return 0xe08e1b;
    case layers::kPlaces:
      return 0x5b6b8c;
    case layers::kRooms:
      return 0x3c9d5f;
    case layers::kBuildings:
      return 0x7b4fa3;
    case layers::kAgents:
      return 0xd1495b;
    case layers::kStructures:
      return 0x3d4250;
    default:
      return LabelColor(static_cast<uint32_t>(layer));
  }
}

uint32_t RelationColor(std::string_view relation) {
  if (relation == relations::kTraversable) return 0x5b6b8c;
  if (relation == relations::kContains) return 0xb9bec8;
  if (relation == relations::kAdjacent) return 0x3c9d5f;
  return LabelColor(1 + HashOf(relation) % 4093);
}

uint32_t AgentColor(size_t index) { return kAgentRgb[index % kAgentRgb.size()]; }

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

}  // namespace dsg
