// SPDX-License-Identifier: Apache-2.0
// Bytes that stores keep: parts of a node, where no more is needed. The whole ones are declared in
// proto_convert.h: EncodeNodePayload, DecodeNodePayload and those of edges, mesh blocks and
// factors.
#pragma once

#include <string>
#include <string_view>

#include "schema/model/node.h"

namespace dsg {

/// As DecodeNodePayload, but what most nodes do not need to be placed may be left out: attributes,
/// agent, structure and region.
bool DecodeNodePlacement(std::string_view bytes, Node* node);

/// As EncodeNodePayload without the attributes, which may be long texts that are packed.
std::string EncodeAllButAttributes(const Node& node);

}  // namespace dsg
