// SPDX-License-Identifier: Apache-2.0
// Factors and shapes: batches of one agent; see schema/store/batches.h.
#include <algorithm>
#include <set>

#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/batches.h"
#include "schema/store/sqlite/commit.h"
#include "schema/store/sqlite/graph_rows.h"

namespace dsg::sqlite {
namespace {

// The statements of a table of current batches.
template <typename Row>
struct BatchTable {
  const char* name;
  const char* insert;
  /// Of one agent, touching a span; columns as BatchRowOf, then id.
  const char* select;
  const char* archive;
  const char* drop;
};

#define DSG_BATCH_TABLE(table, history)                                                  \
  {                                                                                      \
    table,                                                                               \
        "INSERT INTO " table                                                             \
        " (agent, rev_from, t0, t1, checksum, payload) VALUES (?1, ?2, ?3, ?4, ?5, ?6)", \
        "SELECT agent, rev_from, t0, t1, payload, checksum, id FROM " table              \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2 ORDER BY id",                        \
        "INSERT INTO " history                                                           \
        " (id, agent, rev_from, rev_to, t0, t1, checksum, payload)"                      \
        " SELECT id, agent, rev_from, ?2, t0, t1, checksum, payload FROM " table         \
        " WHERE id = ?1 AND rev_from < ?2",                                              \
        "DELETE FROM " table " WHERE id = ?1"                                            \
  }

constexpr BatchTable<FactorRow> kFactors = DSG_BATCH_TABLE("factor_segment", "factor_history");
constexpr BatchTable<ShapeRow> kShapes = DSG_BATCH_TABLE("shape_segment", "shape_history");

#undef DSG_BATCH_TABLE

// A row and the bytes that it shows.
template <typename Row>
struct StoredBatch {
  int64_t id = 0;
  Row row;
  std::string payload;

  bool IsNewerThan(const StoredBatch& other) const {
    return row.rev_from != other.row.rev_from ? row.rev_from > other.row.rev_from : id > other.id;
  }
  Row Whole() const {
    Row whole = row;
    whole.payload = payload;
    return whole;
  }
};

template <typename Row>
absl::Status InsertBatch(const BatchTable<Row>& table, NodeId agent, TimeNs t0, TimeNs t1,
                         const std::string& payload, CommitContext* commit) {
  const Row row{{agent, commit->revision(), t0, t1, payload}};
  commit->head.sums.Add(row);
  return Query(commit->db, table.insert)
      .Bind(KeyOf(agent), row.rev_from, t0, t1, ChecksumOf(row), Query::BlobView{payload})
      .Run();
}

template <typename Row>
absl::StatusOr<std::vector<StoredBatch<Row>>> ReadBatches(const BatchTable<Row>& table,
                                                          const TrackSpan& span,
                                                          CommitContext* commit) {
  std::vector<StoredBatch<Row>> batches;
  Query query(commit->db, table.select);
  query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(Row row, BatchRowOf<Row>(query, commit->spec.name));
    std::string payload(row.payload);
    row.payload = {};
    batches.push_back({query.Int(6), row, std::move(payload)});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return batches;
}

template <typename Row>
absl::Status EndBatch(const BatchTable<Row>& table, const StoredBatch<Row>& batch,
                      CommitContext* commit) {
  commit->head.sums.Remove(batch.Whole());
  DSG_RETURN_IF_ERROR(Query(commit->db, table.archive).Bind(batch.id, commit->revision()).Run());
  return Query(commit->db, table.drop).Bind(batch.id).Run();
}

// Times of shapes that hide those of `batch`: written anew, it must not come out on top of them.
absl::StatusOr<std::set<TimeNs>> HiddenTimes(const StoredBatch<ShapeRow>& batch,
                                             CommitContext* commit) {
  const ShapeRow& row = batch.row;
  const TimeNs to_ns = row.t1 == kTimeMax ? kTimeMax : row.t1 + 1;
  DSG_ASSIGN_OR_RETURN(const auto around, ReadBatches(kShapes, {row.agent, row.t0, to_ns}, commit));
  std::set<TimeNs> hidden;
  std::vector<TimeNs> times;
  for (const auto& other : around) {
    if (!other.IsNewerThan(batch)) continue;
    if (!DecodeShapeTimes(other.payload, &times)) {
      return CorruptRow(commit->spec.name, kShapes.name, ToString(row.agent));
    }
    hidden.insert(times.begin(), times.end());
  }
  return hidden;
}

absl::Status CutShapeBatch(const TrackSpan& span, const StoredBatch<ShapeRow>& batch,
                           CommitContext* commit) {
  if (Covers(span, batch.row.t0, batch.row.t1)) return EndBatch(kShapes, batch, commit);
  DecodedShapes decoded;
  if (!DecodeShapes(batch.payload, /*with_vertices=*/true, &decoded)) {
    return CorruptRow(commit->spec.name, kShapes.name, ToString(span.agent));
  }
  DSG_ASSIGN_OR_RETURN(const std::set<TimeNs> hidden, HiddenTimes(batch, commit));
  ShapeAppend rest{span.agent, decoded.topology, {}};
  bool is_touched = false;
  for (BodyShape& shape : decoded.shapes) {
    const bool goes = Holds(span, shape.time_ns);
    is_touched |= goes;
    if (!goes && !hidden.contains(shape.time_ns)) rest.shapes.push_back(std::move(shape));
  }
  if (!is_touched) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(EndBatch(kShapes, batch, commit));
  return WriteShapes({rest}, commit);
}

}  // namespace

absl::Status WriteFactors(const std::vector<FactorAppend>& factors, CommitContext* commit) {
  for (const FactorAppend& item : factors) {
    if (item.factors.empty()) continue;
    const BatchTimes times = TimesOf(item.factors);
    DSG_RETURN_IF_ERROR(
        InsertBatch(kFactors, item.agent, times.t0, times.t1, EncodeFactors(item.factors), commit));
  }
  return absl::OkStatus();
}

absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes, CommitContext* commit) {
  for (const ShapeAppend& item : shapes) {
    for (size_t first = 0; first < item.shapes.size();) {
      const ShapeAppend batch = CutBatch(item, first);
      first += batch.shapes.size();
      DSG_RETURN_IF_ERROR(InsertBatch(kShapes, batch.agent, batch.shapes.front().time_ns,
                                      batch.shapes.back().time_ns,
                                      EncodeShapes(batch, commit->spec.codec), commit));
    }
  }
  return absl::OkStatus();
}

absl::Status EndFactors(const TrackSpan& span, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const auto batches, ReadBatches(kFactors, span, commit));
  for (const auto& batch : batches) {
    if (Covers(span, batch.row.t0, batch.row.t1)) {
      DSG_RETURN_IF_ERROR(EndBatch(kFactors, batch, commit));
      continue;
    }
    std::vector<PoseFactor> factors;
    if (!DecodeFactors(batch.payload, &factors)) {
      return CorruptRow(commit->spec.name, kFactors.name, ToString(span.agent));
    }
    const auto goes = [&](const PoseFactor& factor) { return Touches(factor, span); };
    if (std::erase_if(factors, goes) == 0) continue;
    DSG_RETURN_IF_ERROR(EndBatch(kFactors, batch, commit));
    DSG_RETURN_IF_ERROR(WriteFactors({{span.agent, std::move(factors)}}, commit));
  }
  return absl::OkStatus();
}

absl::Status EndShapes(const TrackSpan& span, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const auto batches, ReadBatches(kShapes, span, commit));
  for (const auto& batch : batches) DSG_RETURN_IF_ERROR(CutShapeBatch(span, batch, commit));
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
