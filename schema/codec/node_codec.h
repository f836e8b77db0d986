// SPDX-License-Identifier: Apache-2.0
// A part of a stored node, for who needs no more; all of it is DecodeNodePayload.
#pragma once

#include <string_view>

#include "schema/model/node.h"

namespace dsg {

/// As DecodeNodePayload, but what most nodes do not need to be placed may be left out: attributes,
/// agent, structure and region.
bool DecodeNodePlacement(std::string_view bytes, Node* node);

}  // namespace dsg
