// SPDX-License-Identifier: Apache-2.0
// Boxes of parents grown over their children, as the store demands.
// Refuses to give an extent to who has none.
#pragma once

#include <vector>

#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"

namespace dsg::merge {

/// `nodes` in any order; edges other than CONTAINS are passed over.
void FitParents(const std::vector<Layer>& layers, const std::vector<Edge>& edges,
                std::vector<Node>* nodes);

}  // namespace dsg::merge
