// SPDX-License-Identifier: Apache-2.0
// Factors and shapes: batches of one agent, which are ended whole; what was not meant of an ended
// batch is written anew.
#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {
namespace {

struct BatchTable {
  char letter;
  const char* name;
  const char* insert;
  /// Of one agent, touching a span.
  const char* select;
  const char* archive;
  const char* drop;
};

#define DSG_BATCH_TABLE(letter, table, history)                                          \
  {                                                                                      \
    letter, table,                                                                       \
        "INSERT INTO " table                                                             \
        " (agent, rev_from, t0, t1, checksum, payload) VALUES (?1, ?2, ?3, ?4, ?5, ?6)", \
        "SELECT id, rev_from, t0, t1, checksum, payload FROM " table                     \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2 ORDER BY id",                        \
        "INSERT INTO " history                                                           \
        " (id, agent, rev_from, rev_to, t0, t1, checksum, payload)"                      \
        " SELECT id, agent, rev_from, ?2, t0, t1, checksum, payload FROM " table         \
        " WHERE id = ?1 AND rev_from < ?2",                                              \
        "DELETE FROM " table " WHERE id = ?1"                                            \
  }

constexpr BatchTable kFactors = DSG_BATCH_TABLE('F', "factor_segment", "factor_history");
constexpr BatchTable kShapes = DSG_BATCH_TABLE('H', "shape_segment", "shape_history");

#undef DSG_BATCH_TABLE

struct BatchRow {
  int64_t id = 0;
  Revision rev_from = 0;
  TimeNs t0 = 0;
  TimeNs t1 = 0;
  std::string payload;

  bool IsNewerThan(const BatchRow& other) const {
    return rev_from != other.rev_from ? rev_from > other.rev_from : id > other.id;
  }
};

absl::Status InsertBatch(const BatchTable& table, NodeId agent, TimeNs t0, TimeNs t1,
                         const std::string& payload, CommitContext* commit) {
  const std::initializer_list<int64_t> columns = {KeyOf(agent), commit->revision(), t0, t1};
  commit->head.content.Add(RowIdentity(table.letter, columns, payload));
  return Query(commit->db, table.insert)
      .Bind(KeyOf(agent), commit->revision(), t0, t1, RowChecksum(columns, payload),
            Query::BlobView{payload})
      .Run();
}

absl::StatusOr<std::vector<BatchRow>> ReadBatches(const BatchTable& table, const TrackSpan& span,
                                                  CommitContext* commit) {
  std::vector<BatchRow> rows;
  Query query(commit->db, table.select);
  query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
  while (query.Next()) {
    BatchRow row{query.Int(0), query.Int(1), query.Int(2), query.Int(3),
                 std::string(query.Blob(5))};
    if (query.Int(4) !=
        RowChecksum({KeyOf(span.agent), row.rev_from, row.t0, row.t1}, row.payload)) {
      return CorruptRow(commit->spec.name, table.name, ToString(span.agent));
    }
    rows.push_back(std::move(row));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return rows;
}

absl::Status EndBatch(const BatchTable& table, NodeId agent, const BatchRow& row,
                      CommitContext* commit) {
  commit->head.content.Remove(
      RowIdentity(table.letter, {KeyOf(agent), row.rev_from, row.t0, row.t1}, row.payload));
  DSG_RETURN_IF_ERROR(Query(commit->db, table.archive).Bind(row.id, commit->revision()).Run());
  return Query(commit->db, table.drop).Bind(row.id).Run();
}

// The shapes from `first` on that make one segment.
ShapeAppend CutShapes(const ShapeAppend& item, size_t first) {
  ShapeAppend segment{item.agent, item.topology, {}};
  const TimeNs t0 = item.shapes[first].time_ns;
  for (size_t i = first; i < item.shapes.size(); ++i) {
    const BodyShape& shape = item.shapes[i];
    // Times may lie further apart than 63 bits count.
    const uint64_t length_ns = static_cast<uint64_t>(shape.time_ns) - static_cast<uint64_t>(t0);
    if (segment.shapes.size() == kShapesPerSegmentMax ||
        length_ns > static_cast<uint64_t>(kShapeSegmentNsMax)) {
      break;
    }
    segment.shapes.push_back(shape);
  }
  return segment;
}

// Times of shapes that hide those of `row`: written anew, it must not come out on top of them.
absl::StatusOr<std::set<TimeNs>> HiddenTimes(NodeId agent, const BatchRow& row,
                                             CommitContext* commit) {
  const TimeNs to_ns = row.t1 == kTimeMax ? kTimeMax : row.t1 + 1;
  DSG_ASSIGN_OR_RETURN(const auto around, ReadBatches(kShapes, {agent, row.t0, to_ns}, commit));
  std::set<TimeNs> hidden;
  std::vector<TimeNs> times;
  for (const BatchRow& other : around) {
    if (!other.IsNewerThan(row)) continue;
    if (!DecodeShapeTimes(other.payload, &times)) {
      return CorruptRow(commit->spec.name, kShapes.name, ToString(agent));
    }
    hidden.insert(times.begin(), times.end());
  }
  return hidden;
}

// All of the row goes, whatever is in it.
bool Covers(const TrackSpan& span, const BatchRow& row) {
  return span.from_ns <= row.t0 && row.t1 < span.to_ns;
}

bool Touches(const PoseFactor& factor, const TrackSpan& span) {
  const auto holds = [&](TimeNs t) { return span.from_ns <= t && t < span.to_ns; };
  const bool ends_here = factor.to_agent.empty() || factor.to_agent == span.agent;
  return holds(factor.from_ns) || (ends_here && holds(factor.to_ns));
}

absl::Status CutShapeRow(const TrackSpan& span, const BatchRow& row, CommitContext* commit) {
  if (Covers(span, row)) return EndBatch(kShapes, span.agent, row, commit);
  DecodedShapes decoded;
  if (!DecodeShapes(row.payload, /*with_vertices=*/true, &decoded)) {
    return CorruptRow(commit->spec.name, kShapes.name, ToString(span.agent));
  }
  DSG_ASSIGN_OR_RETURN(const std::set<TimeNs> hidden, HiddenTimes(span.agent, row, commit));
  ShapeAppend rest{span.agent, decoded.topology, {}};
  bool is_touched = false;
  for (BodyShape& shape : decoded.shapes) {
    const bool goes = span.from_ns <= shape.time_ns && shape.time_ns < span.to_ns;
    is_touched |= goes;
    if (!goes && !hidden.contains(shape.time_ns)) rest.shapes.push_back(std::move(shape));
  }
  if (!is_touched) return absl::OkStatus();
  DSG_RETURN_IF_ERROR(EndBatch(kShapes, span.agent, row, commit));
  return WriteShapes({rest}, commit);
}

}  // namespace

absl::Status WriteFactors(const std::vector<FactorAppend>& factors, CommitContext* commit) {
  for (const FactorAppend& item : factors) {
    if (item.factors.empty()) continue;
    TimeNs t0 = kTimeMax;
    TimeNs t1 = kTimeMin;
    for (const PoseFactor& factor : item.factors) {
      t0 = std::min({t0, factor.from_ns, factor.to_ns});
      t1 = std::max({t1, factor.from_ns, factor.to_ns});
    }
    DSG_RETURN_IF_ERROR(
        InsertBatch(kFactors, item.agent, t0, t1, EncodeFactors(item.factors), commit));
  }
  return absl::OkStatus();
}

absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes, CommitContext* commit) {
  for (const ShapeAppend& item : shapes) {
    for (size_t first = 0; first < item.shapes.size();) {
      const ShapeAppend segment = CutShapes(item, first);
      first += segment.shapes.size();
      DSG_RETURN_IF_ERROR(InsertBatch(kShapes, segment.agent, segment.shapes.front().time_ns,
                                      segment.shapes.back().time_ns,
                                      EncodeShapes(segment, commit->spec.codec), commit));
    }
  }
  return absl::OkStatus();
}

absl::Status EndFactors(const TrackSpan& span, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const auto rows, ReadBatches(kFactors, span, commit));
  for (const BatchRow& row : rows) {
    if (Covers(span, row)) {
      DSG_RETURN_IF_ERROR(EndBatch(kFactors, span.agent, row, commit));
      continue;
    }
    std::vector<PoseFactor> factors;
    if (!DecodeFactors(row.payload, &factors)) {
      return CorruptRow(commit->spec.name, kFactors.name, ToString(span.agent));
    }
    const auto goes = [&](const PoseFactor& factor) { return Touches(factor, span); };
    if (std::erase_if(factors, goes) == 0) continue;
    DSG_RETURN_IF_ERROR(EndBatch(kFactors, span.agent, row, commit));
    DSG_RETURN_IF_ERROR(WriteFactors({{span.agent, std::move(factors)}}, commit));
  }
  return absl::OkStatus();
}

absl::Status EndShapes(const TrackSpan& span, CommitContext* commit) {
  DSG_ASSIGN_OR_RETURN(const auto rows, ReadBatches(kShapes, span, commit));
  for (const BatchRow& row : rows) DSG_RETURN_IF_ERROR(CutShapeRow(span, row, commit));
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
