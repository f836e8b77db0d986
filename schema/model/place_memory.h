// SPDX-License-Identifier: Apache-2.0
// What a robot knows places by, over several logs and maps.
#pragma once

#include "schema/model/node.h"

namespace dsg {

/// Adds what `seen`, the same agent in another log or map, knows places by to what `known` does.
void AddPlaceMemory(const Node& seen, Node* known);

}  // namespace dsg
