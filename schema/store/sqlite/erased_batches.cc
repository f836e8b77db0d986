// SPDX-License-Identifier: Apache-2.0
// Shapes and factors of the past. A batch of which a part goes is written anew in its place, at the
// same revisions.
#include <algorithm>

#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/sqlite/erased_rows.h"

namespace dsg::sqlite {
namespace {

struct BatchRow {
  int64_t row_id = 0;
  int64_t agent = 0;
  Revision rev_from = 0;
  Revision rev_to = 0;
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::string payload;
};

// What is left of a batch; no bytes when nothing is.
struct Rest {
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::string payload;
};

struct BatchTable {
  char letter;
  const char* name;
  const char* select_all;
  const char* select_span;
  const char* update;
  const char* drop;
};

#define DSG_PAST_BATCHES(letter, table)                                                        \
  {                                                                                            \
    letter, table,                                                                             \
        "SELECT rowid, agent, rev_from, rev_to, t0, t1, checksum, payload FROM " table         \
        " WHERE agent = ?1",                                                                   \
        "SELECT rowid, agent, rev_from, rev_to, t0, t1, checksum, payload FROM " table         \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2",                                          \
        "UPDATE " table " SET t0 = ?2, t1 = ?3, checksum = ?4, payload = ?5 WHERE rowid = ?1", \
        "DELETE FROM " table " WHERE rowid = ?1"                                               \
  }
#define DSG_CURRENT_BATCHES(letter, table)                                              \
  {                                                                                     \
    letter, table,                                                                      \
        "SELECT rowid, agent, rev_from, 9223372036854775807, t0, t1, checksum, payload" \
        " FROM " table " WHERE agent = ?1",                                             \
        nullptr, nullptr, "DELETE FROM " table " WHERE rowid = ?1"                      \
  }

constexpr BatchTable kPastShapes = DSG_PAST_BATCHES('H', "shape_history");
constexpr BatchTable kPastFactors = DSG_PAST_BATCHES('F', "factor_history");
constexpr BatchTable kShapes = DSG_CURRENT_BATCHES('H', "shape_segment");
constexpr BatchTable kFactors = DSG_CURRENT_BATCHES('F', "factor_segment");

#undef DSG_PAST_BATCHES
#undef DSG_CURRENT_BATCHES

RowSums SumsOf(const BatchTable& table, const BatchRow& row) {
  RowSums sums;
  sums.content.Add(
      RowIdentity(table.letter, {row.agent, row.rev_from, row.t0, row.t1}, row.payload));
  return sums;
}

// Steps to the next row; false at the end or when `status` says why not.
absl::StatusOr<bool> NextRow(const BatchTable& table, Query* query, BatchRow* row,
                             const std::string& map) {
  if (!query->Next()) {
    DSG_RETURN_IF_ERROR(query->status());
    return false;
  }
  *row = {query->Int(0),
          query->Int(1),
          query->Int(2),
          query->Int(3),
          query->Int(4),
          query->Int(5),
          std::string(query->Blob(7))};
  if (query->Int(6) == RowChecksum({row->agent, row->rev_from, row->t0, row->t1}, row->payload)) {
    return true;
  }
  return CorruptRow(map, table.name, ToString(IdOf(row->agent)));
}

void CollectTopology(const BatchTable& table, const BatchRow& row, ErasedRows* erased) {
  std::optional<Sha256> topology;
  if (table.letter == 'H' && DecodeShapeTopology(row.payload, &topology) && topology.has_value()) {
    erased->assets.insert(*topology);
  }
}

bool Holds(const TrackSpan& span, TimeNs t) { return span.from_ns <= t && t < span.to_ns; }

// Nullopt if nothing of the row lies in the span.
absl::StatusOr<std::optional<Rest>> CutShapes(const TrackSpan& span, const BatchRow& row,
                                              const MapSpec& spec) {
  DecodedShapes decoded;
  if (!DecodeShapes(row.payload, /*with_vertices=*/true, &decoded)) {
    return CorruptRow(spec.name, kPastShapes.name, ToString(span.agent));
  }
  ShapeAppend rest{span.agent, decoded.topology, std::move(decoded.shapes)};
  const auto gone = std::erase_if(
      rest.shapes, [&](const BodyShape& shape) { return Holds(span, shape.time_ns); });
  if (gone == 0) return std::optional<Rest>();
  if (rest.shapes.empty()) return std::optional<Rest>(Rest());
  return std::optional<Rest>(Rest{rest.shapes.front().time_ns, rest.shapes.back().time_ns,
                                  EncodeShapes(rest, spec.codec)});
}

absl::StatusOr<std::optional<Rest>> CutFactors(const TrackSpan& span, const BatchRow& row,
                                               const MapSpec& spec) {
  std::vector<PoseFactor> factors;
  if (!DecodeFactors(row.payload, &factors)) {
    return CorruptRow(spec.name, kPastFactors.name, ToString(span.agent));
  }
  const auto gone = std::erase_if(factors, [&](const PoseFactor& factor) {
    const bool ends_here = factor.to_agent.empty() || factor.to_agent == span.agent;
    return Holds(span, factor.from_ns) || (ends_here && Holds(span, factor.to_ns));
  });
  if (gone == 0) return std::optional<Rest>();
  if (factors.empty()) return std::optional<Rest>(Rest());
  Rest rest{kTimeMax, kTimeMin, EncodeFactors(factors)};
  for (const PoseFactor& factor : factors) {
    rest.t0 = std::min({rest.t0, factor.from_ns, factor.to_ns});
    rest.t1 = std::max({rest.t1, factor.from_ns, factor.to_ns});
  }
  return std::optional<Rest>(std::move(rest));
}

absl::Status Replace(const BatchTable& table, const BatchRow& row, Rest rest, ErasedRows* erased) {
  erased->Take(SumsOf(table, row), row.rev_from, row.rev_to, row.payload.size());
  CollectTopology(table, row, erased);
  if (rest.payload.empty()) return Query(erased->db, table.drop).Bind(row.row_id).Run();
  BatchRow left = row;
  left.t0 = rest.t0;
  left.t1 = rest.t1;
  left.payload = std::move(rest.payload);
  erased->past.Put(SumsOf(table, left), left.rev_from, left.rev_to);
  const int64_t checksum = RowChecksum({left.agent, left.rev_from, left.t0, left.t1}, left.payload);
  return Query(erased->db, table.update)
      .Bind(left.row_id, left.t0, left.t1, checksum, Query::BlobView{left.payload})
      .Run();
}

template <typename Cut>
absl::Status CutBatches(const BatchTable& table, const TrackSpan& span, const Cut& cut,
                        ErasedRows* erased) {
  std::vector<std::pair<BatchRow, Rest>> touched;
  {
    Query query(erased->db, table.select_span);
    query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
    BatchRow row;
    for (;;) {
      DSG_ASSIGN_OR_RETURN(const bool found, NextRow(table, &query, &row, erased->spec.name));
      if (!found) break;
      DSG_ASSIGN_OR_RETURN(std::optional<Rest> rest, cut(span, row, erased->spec));
      if (rest.has_value()) touched.emplace_back(row, *std::move(rest));
    }
  }
  for (auto& [row, rest] : touched) {
    DSG_RETURN_IF_ERROR(Replace(table, row, std::move(rest), erased));
  }
  return absl::OkStatus();
}

absl::Status TakeBatches(const BatchTable& table, NodeId agent, ErasedRows* erased) {
  std::vector<int64_t> row_ids;
  {
    Query query(erased->db, table.select_all);
    query.Bind(KeyOf(agent));
    BatchRow row;
    for (;;) {
      DSG_ASSIGN_OR_RETURN(const bool found, NextRow(table, &query, &row, erased->spec.name));
      if (!found) break;
      erased->Take(SumsOf(table, row), row.rev_from, row.rev_to, row.payload.size());
      CollectTopology(table, row, erased);
      row_ids.push_back(row.row_id);
    }
  }
  for (const int64_t row_id : row_ids) {
    DSG_RETURN_IF_ERROR(Query(erased->db, table.drop).Bind(row_id).Run());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status EraseBatchRows(const TrackSpan& span, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(CutBatches(kPastShapes, span, CutShapes, erased));
  return CutBatches(kPastFactors, span, CutFactors, erased);
}

absl::Status EraseAllBatches(NodeId agent, ErasedRows* erased) {
  for (const BatchTable* table : {&kPastShapes, &kPastFactors, &kShapes, &kFactors}) {
    DSG_RETURN_IF_ERROR(TakeBatches(*table, agent, erased));
  }
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
