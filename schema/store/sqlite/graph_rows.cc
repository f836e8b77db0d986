// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/graph_rows.h"

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {

absl::StatusOr<Node> NodeFromRow(const Query& query, const std::string& map) {
  const NodeRow row{IdOf(query.Int(0)), query.Int(1), static_cast<LayerId>(query.Int(2)),
                    query.Blob(3)};
  Node node;
  if (query.Int(4) != ChecksumOf(row) || !DecodeNodePayload(row.payload, &node)) {
    return CorruptRow(map, "node", ToString(row.id));
  }
  node.id = row.id;
  node.revision = row.rev_from;
  node.layer = row.layer;
  return node;
}

absl::StatusOr<EdgeRow> EdgeRowOf(const Query& query, const std::string& map) {
  const EdgeRow row{IdOf(query.Int(0)), query.Int(1),  IdOf(query.Int(2)),
                    query.Int(3),       query.Real(4), query.Blob(5)};
  if (query.Int(6) == ChecksumOf(row)) return row;
  return CorruptRow(map, "edge", absl::StrCat(ToString(row.source), " ", ToString(row.target)));
}

absl::StatusOr<Edge> EdgeFromRow(const Query& query, std::string_view relation,
                                 const std::string& map) {
  DSG_ASSIGN_OR_RETURN(const EdgeRow row, EdgeRowOf(query, map));
  Edge edge;
  edge.source = row.source;
  edge.target = row.target;
  edge.revision = row.rev_from;
  edge.weight = row.weight;
  edge.relation = relation;
  // Nearly all edges have nothing to decode.
  if (row.payload.empty() || DecodeEdgePayload(row.payload, &edge)) return edge;
  return CorruptRow(
      map, "edge",
      absl::StrCat(ToString(edge.source), " ", edge.relation, " ", ToString(edge.target)));
}

absl::StatusOr<StayRow> StayRowOf(const Query& query, const std::string& map) {
  const StayRow row{IdOf(query.Int(0)), query.Int(1),       query.Int(2),
                    IdOf(query.Int(3)), IdOf(query.Int(4)), query.Int(5)};
  if (query.Int(6) == ChecksumOf(row)) return row;
  return CorruptRow(map, "stay", absl::StrCat(ToString(row.agent), " ", row.enter_ns));
}

absl::StatusOr<MeshRow> MeshRowOf(const Query& query, const std::string& map) {
  const MeshRow row{{static_cast<int32_t>(query.Int(0)), static_cast<int32_t>(query.Int(1)),
                     static_cast<int32_t>(query.Int(2))},
                    query.Int(3),
                    query.Blob(4)};
  if (query.Int(5) == ChecksumOf(row)) return row;
  return CorruptRow(map, "mesh_block",
                    absl::StrCat(row.index.x, ",", row.index.y, ",", row.index.z));
}

template <typename Row>
absl::StatusOr<Row> BatchRowOf(const Query& query, const std::string& map) {
  Row row;
  row.agent = IdOf(query.Int(0));
  row.rev_from = query.Int(1);
  row.t0 = query.Int(2);
  row.t1 = query.Int(3);
  row.payload = query.Blob(4);
  if (query.Int(5) == ChecksumOf(row)) return row;
  return CorruptRow(map, Row::kLetter == FactorRow::kLetter ? "factor_segment" : "shape_segment",
                    ToString(row.agent));
}

template absl::StatusOr<FactorRow> BatchRowOf(const Query& query, const std::string& map);
template absl::StatusOr<ShapeRow> BatchRowOf(const Query& query, const std::string& map);

}  // namespace dsg::sqlite
