// SPDX-License-Identifier: Apache-2.0
// Nodes and edges as rows give them, their checksums proven.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/model/edge.h"
#include "schema/model/node.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Columns: key, rev_from, layer, payload, checksum. `map` is for messages.
absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map);

/// Columns: source, relation, target, rev_from, weight, payload, checksum.
absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map);

}  // namespace dsg::sqlite
