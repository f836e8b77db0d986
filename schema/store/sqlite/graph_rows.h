// SPDX-License-Identifier: Apache-2.0
// Rows as statements give them, their checksums proven: the one place that knows the columns.
// Payloads are views of the statement's row, which the next step ends.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/model/edge.h"
#include "schema/model/node.h"
#include "schema/store/content_rows.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Columns: key, rev_from, layer, payload, checksum. `map` is for messages.
/// Errors of all: DATA_LOSS/STORE_CORRUPT for a row that is not what was written.
absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map);

/// Columns: source, relation, target, rev_from, weight, payload, checksum.
absl::StatusOr<EdgeRow> EdgeRowOf(const Query& query, const std::string& map);
/// The same columns, of an edge of that relation.
absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map);

/// Columns: agent, enter_ns, exit_ns, place, room, rev_from, checksum.
absl::StatusOr<StayRow> StayRowOf(const Query& query, const std::string& map);

/// Columns: x, y, z, rev_from, payload, checksum.
absl::StatusOr<MeshRow> MeshRowOf(const Query& query, const std::string& map);

/// Columns: agent, rev_from, t0, t1, payload, checksum. Row: FactorRow or ShapeRow.
template <typename Row>
absl::StatusOr<Row> BatchRowOf(const Query& query, const std::string& map);

}  // namespace dsg::sqlite
