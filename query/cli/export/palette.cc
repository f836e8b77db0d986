// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/palette.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "schema/model/edge.h"

namespace dsg::cli {
namespace {

constexpr uint32_t kUnknownRgb = 0x9aa0a6;
// Steps of this part of the circle never come near to where they were.
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

// The same on every machine, which std::hash does not promise (FNV-1a).
uint32_t HashOf(std::string_view text) {
  uint32_t hash = 2166136261u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return hash;
}

// A number that stands for the class; 0 = none.
uint32_t ClassNumber(const Node& node) {
  if (node.class_id > 0) return static_cast<uint32_t>(node.class_id);
  if (!node.class_name.empty()) return 1 + HashOf(node.class_name) % 4093;
  return 0;
}

}  // namespace

uint32_t LabelColor(uint32_t label) {
  if (label == 0) return kUnknownRgb;
  // Three depths in turn keep labels apart whose hues come near each other.
  constexpr std::array<double, 3> kValues = {0.85, 0.65, 0.95};
  constexpr std::array<double, 3> kSaturations = {0.65, 0.75, 0.45};
  return FromHsv(HueOf(label), kSaturations[label % 3], kValues[label % 3]);
}

uint32_t ClassColor(const Node& node) { return LabelColor(ClassNumber(node)); }

uint32_t FloorColor(const Node& node) {
  const uint32_t number = ClassNumber(node);
  const auto index = static_cast<uint32_t>(node.id.index() % 4093);
  return FromHsv(HueOf(number == 0 ? index : number), 0.13, 0.95);
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

}  // namespace dsg::cli
