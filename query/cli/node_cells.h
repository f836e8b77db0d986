// SPDX-License-Identifier: Apache-2.0
// The cells that every listing of nodes has in common, and how positions and footers are written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "query/cli/table.h"

namespace dsg::v1 {
class Node;
class Vector3;
}  // namespace dsg::v1

namespace dsg::cli {

std::vector<Column> NodeColumns();
std::vector<std::string> NodeCells(const v1::Node& node);

/// "x 1.20 y 3.40 z 0.00 m".
std::string PositionText(const v1::Vector3& position);

/// "3 nodes (revision 6)", and how to see more where the list is cut.
std::string Footer(int64_t count, const std::string& noun, int64_t revision, bool is_cut);

}  // namespace dsg::cli
