// SPDX-License-Identifier: Apache-2.0
// Where nodes are: each stands in one cell of a cubic grid that is as coarse as the node is large,
// an ordinary index row of a fifth of what an R*Tree takes (docs/adr/0011-node-cells.md).
// Refuses to be exact: it gives candidates, whose boxes the caller checks.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "schema/model/node.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// The cell of a box in the map frame: the power of two that is its edge length, at least 1 m, in
/// bits 57 to 61, then x, y and z of the cell, 19 bits each, modulo 2^19.
int64_t CellOf(const Box3d& box_map);

/// Agents are where their tracks say, and have no cell.
absl::Status AddCell(Database& db, const Node& node);
absl::Status RemoveCell(Database& db, const Node& node);
absl::StatusOr<bool> HasCell(Database& db, const Node& node);

/// Current nodes that may touch the box, in no order. Cost: an index seek for each cell along x,
/// at most some hundred of them for each edge length that the map has.
absl::StatusOr<std::vector<NodeId>> FindNear(Database& db, const Box3d& box_map);

}  // namespace dsg::sqlite
