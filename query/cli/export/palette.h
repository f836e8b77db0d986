// SPDX-License-Identifier: Apache-2.0
// Colours for what has none of its own: labels, classes, layers, relations, agents.
// Refuses chance: the same label has the same colour in every file and picture.
#pragma once

#include <cstdint>
#include <string_view>

#include "schema/model/node.h"

namespace dsg::cli {

// All colours are 0xRRGGBB.

/// Far from those of the neighbouring labels; 0, the unknown, is grey.
uint32_t LabelColor(uint32_t label);
/// By class id, or by class name where there is no id; grey without either.
uint32_t ClassColor(const Node& node);
/// The same, pale, for floors that other things stand on. Neighbours without a class differ.
uint32_t FloorColor(const Node& node);
uint32_t LayerColor(LayerId layer);
uint32_t RelationColor(std::string_view relation);
/// The n-th agent of a map.
uint32_t AgentColor(size_t index);

}  // namespace dsg::cli
