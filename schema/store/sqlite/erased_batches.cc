// SPDX-License-Identifier: Apache-2.0
// Shapes and factors of the past. A batch of which a part goes is written anew in its place, at the
// same revisions.
#include <algorithm>

#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/batches.h"
#include "schema/store/sqlite/erased_rows.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

// A row, its bytes, and how long it was believed.
template <typename Row>
struct StoredBatch {
  int64_t row_id = 0;
  Revision rev_to = 0;
  Row row;
  std::string payload;
};

// What is left of a batch; no bytes when nothing is.
struct Rest {
  BatchTimes times;
  std::string payload;
};

// The statements of a table of batches; columns as BatchRowOf, then rev_to and the id of the row.
template <typename Row>
struct BatchTable {
  const char* name;
  const char* select_all;
  const char* select_span;
  const char* update;
  const char* drop;
};

#define DSG_PAST_BATCHES(table)                                                                \
  {                                                                                            \
    table,                                                                                     \
        "SELECT agent, rev_from, t0, t1, payload, checksum, rev_to, rowid FROM " table         \
        " WHERE agent = ?1",                                                                   \
        "SELECT agent, rev_from, t0, t1, payload, checksum, rev_to, rowid FROM " table         \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2",                                          \
        "UPDATE " table " SET t0 = ?2, t1 = ?3, checksum = ?4, payload = ?5 WHERE rowid = ?1", \
        "DELETE FROM " table " WHERE rowid = ?1"                                               \
  }
#define DSG_CURRENT_BATCHES(table)                                                      \
  {                                                                                     \
    table,                                                                              \
        "SELECT agent, rev_from, t0, t1, payload, checksum, 9223372036854775807, rowid" \
        " FROM " table " WHERE agent = ?1",                                             \
        nullptr, nullptr, "DELETE FROM " table " WHERE rowid = ?1"                      \
  }

constexpr BatchTable<ShapeRow> kPastShapes = DSG_PAST_BATCHES("shape_history");
constexpr BatchTable<FactorRow> kPastFactors = DSG_PAST_BATCHES("factor_history");
constexpr BatchTable<ShapeRow> kShapes = DSG_CURRENT_BATCHES("shape_segment");
constexpr BatchTable<FactorRow> kFactors = DSG_CURRENT_BATCHES("factor_segment");

#undef DSG_PAST_BATCHES
#undef DSG_CURRENT_BATCHES

template <typename Row>
RowSums SumsOf(Row row, std::string_view payload) {
  row.payload = payload;
  RowSums sums;
  sums.Add(row);
  return sums;
}

template <typename Row>
absl::StatusOr<std::vector<StoredBatch<Row>>> ReadBatches(Query* query, const std::string& map) {
  std::vector<StoredBatch<Row>> batches;
  while (query->Next()) {
    DSG_ASSIGN_OR_RETURN(const Row row, BatchRowOf<Row>(*query, map));
    batches.push_back({query->Int(7), query->Int(6), row, std::string(row.payload)});
    batches.back().row.payload = {};
  }
  DSG_RETURN_IF_ERROR(query->status());
  return batches;
}

void CollectTopology(const StoredBatch<ShapeRow>& batch, ErasedRows* erased) {
  std::optional<Sha256> topology;
  if (DecodeShapeTopology(batch.payload, &topology) && topology.has_value()) {
    erased->assets.insert(*topology);
  }
}
void CollectTopology(const StoredBatch<FactorRow>& /*batch*/, ErasedRows* /*erased*/) {}

// Nullopt if nothing of the batch lies in the span.
absl::StatusOr<std::optional<Rest>> CutOut(const TrackSpan& span,
                                           const StoredBatch<ShapeRow>& batch,
                                           const MapSpec& spec) {
  DecodedShapes decoded;
  if (!DecodeShapes(batch.payload, /*with_vertices=*/true, &decoded)) {
    return CorruptRow(spec.name, kPastShapes.name, ToString(span.agent));
  }
  ShapeAppend rest{span.agent, decoded.topology, std::move(decoded.shapes)};
  const auto gone = std::erase_if(
      rest.shapes, [&](const BodyShape& shape) { return Holds(span, shape.time_ns); });
  if (gone == 0) return std::optional<Rest>();
  if (rest.shapes.empty()) return std::optional<Rest>(Rest());
  return std::optional<Rest>(Rest{{rest.shapes.front().time_ns, rest.shapes.back().time_ns},
                                  EncodeShapes(rest, spec.codec)});
}

absl::StatusOr<std::optional<Rest>> CutOut(const TrackSpan& span,
                                           const StoredBatch<FactorRow>& batch,
                                           const MapSpec& spec) {
  std::vector<PoseFactor> factors;
  if (!DecodeFactors(batch.payload, &factors)) {
    return CorruptRow(spec.name, kPastFactors.name, ToString(span.agent));
  }
  const auto gone =
      std::erase_if(factors, [&](const PoseFactor& factor) { return Touches(factor, span); });
  if (gone == 0) return std::optional<Rest>();
  if (factors.empty()) return std::optional<Rest>(Rest());
  return std::optional<Rest>(Rest{TimesOf(factors), EncodeFactors(factors)});
}

template <typename Row>
void Take(const StoredBatch<Row>& batch, ErasedRows* erased) {
  erased->Take(SumsOf(batch.row, batch.payload), batch.row.rev_from, batch.rev_to,
               batch.payload.size());
  CollectTopology(batch, erased);
}

template <typename Row>
absl::Status Replace(const BatchTable<Row>& table, const StoredBatch<Row>& batch, const Rest& rest,
                     ErasedRows* erased) {
  Take(batch, erased);
  if (rest.payload.empty()) return Query(erased->db, table.drop).Bind(batch.row_id).Run();
  Row left = batch.row;
  left.t0 = rest.times.t0;
  left.t1 = rest.times.t1;
  left.payload = rest.payload;
  erased->past.Put(SumsOf(left, rest.payload), left.rev_from, batch.rev_to);
  return Query(erased->db, table.update)
      .Bind(batch.row_id, left.t0, left.t1, ChecksumOf(left), Query::BlobView{rest.payload})
      .Run();
}

template <typename Row>
absl::Status CutBatches(const BatchTable<Row>& table, const TrackSpan& span, ErasedRows* erased) {
  std::vector<std::pair<StoredBatch<Row>, Rest>> touched;
  {
    Query query(erased->db, table.select_span);
    query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
    DSG_ASSIGN_OR_RETURN(auto batches, ReadBatches<Row>(&query, erased->spec.name));
    for (StoredBatch<Row>& batch : batches) {
      DSG_ASSIGN_OR_RETURN(std::optional<Rest> rest, CutOut(span, batch, erased->spec));
      if (rest.has_value()) touched.emplace_back(std::move(batch), *std::move(rest));
    }
  }
  for (const auto& [batch, rest] : touched) {
    DSG_RETURN_IF_ERROR(Replace(table, batch, rest, erased));
  }
  return absl::OkStatus();
}

template <typename Row>
absl::Status TakeBatches(const BatchTable<Row>& table, NodeId agent, ErasedRows* erased) {
  std::vector<StoredBatch<Row>> batches;
  {
    Query query(erased->db, table.select_all);
    query.Bind(KeyOf(agent));
    DSG_ASSIGN_OR_RETURN(batches, ReadBatches<Row>(&query, erased->spec.name));
  }
  for (const StoredBatch<Row>& batch : batches) {
    Take(batch, erased);
    DSG_RETURN_IF_ERROR(Query(erased->db, table.drop).Bind(batch.row_id).Run());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status EraseBatchRows(const TrackSpan& span, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(CutBatches(kPastShapes, span, erased));
  return CutBatches(kPastFactors, span, erased);
}

absl::Status EraseAllBatches(NodeId agent, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(TakeBatches(kPastShapes, agent, erased));
  DSG_RETURN_IF_ERROR(TakeBatches(kPastFactors, agent, erased));
  DSG_RETURN_IF_ERROR(TakeBatches(kShapes, agent, erased));
  return TakeBatches(kFactors, agent, erased);
}

}  // namespace dsg::sqlite
