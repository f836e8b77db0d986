// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/batch_rows.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/track_rules.h"

namespace dsg::sqlite {

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

template <typename Row>
absl::StatusOr<std::vector<StoredBatch<Row>>> ReadBatches(Query* query, const std::string& map) {
  std::vector<StoredBatch<Row>> batches;
  while (query->Next()) {
    DSG_ASSIGN_OR_RETURN(const Row row, BatchRowOf<Row>(*query, map));
    batches.push_back({query->Int(6), query->Int(7), row, std::string(row.payload)});
    batches.back().row.payload = {};
  }
  DSG_RETURN_IF_ERROR(query->status());
  return batches;
}

template absl::StatusOr<std::vector<StoredBatch<FactorRow>>> ReadBatches(Query* query,
                                                                         const std::string& map);
template absl::StatusOr<std::vector<StoredBatch<ShapeRow>>> ReadBatches(Query* query,
                                                                        const std::string& map);

namespace {

// The statements of a table of current batches.
template <typename Row>
struct BatchTable {
  const char* name;
  const char* insert;
  /// Of one agent, touching a span; columns as ReadBatches.
  const char* select;
  const char* archive;
  const char* drop;
};

#define DSG_BATCH_TABLE(table, history)                                                          \
  {                                                                                              \
    table,                                                                                       \
        "INSERT INTO " table                                                                     \
        " (agent, rev_from, t0, t1, checksum, payload) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",         \
        "SELECT agent, rev_from, t0, t1, payload, checksum, id, 9223372036854775807 FROM " table \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2 ORDER BY id",                                \
        "INSERT INTO " history                                                                   \
        " (id, agent, rev_from, rev_to, t0, t1, checksum, payload)"                              \
        " SELECT id, agent, rev_from, ?2, t0, t1, checksum, payload FROM " table                 \
        " WHERE id = ?1 AND rev_from < ?2",                                                      \
        "DELETE FROM " table " WHERE id = ?1"                                                    \
  }

constexpr BatchTable<FactorRow> kFactors = DSG_BATCH_TABLE("factor_segment", "factor_history");
constexpr BatchTable<ShapeRow> kShapes = DSG_BATCH_TABLE("shape_segment", "shape_history");

#undef DSG_BATCH_TABLE

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
absl::StatusOr<std::vector<StoredBatch<Row>>> ReadCurrent(const BatchTable<Row>& table,
                                                          const TrackSpan& span,
                                                          CommitContext* commit) {
  Query query(commit->db, table.select);
  query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
  return ReadBatches<Row>(&query, commit->spec.name);
}

template <typename Row>
absl::Status EndBatch(const BatchTable<Row>& table, const StoredBatch<Row>& batch,
                      CommitContext* commit) {
  commit->head.sums.Remove(batch.Whole());
  DSG_RETURN_IF_ERROR(
      Query(commit->db, table.archive).Bind(batch.row_id, commit->revision()).Run());
  return Query(commit->db, table.drop).Bind(batch.row_id).Run();
}

bool IsNewer(const StoredBatch<ShapeRow>& batch, const StoredBatch<ShapeRow>& other) {
  return std::tie(batch.row.rev_from, batch.row_id) > std::tie(other.row.rev_from, other.row_id);
}

// Times of shapes that hide those of `batch`: written anew, it must not come out on top of them.
absl::StatusOr<std::set<TimeNs>> HiddenTimes(const StoredBatch<ShapeRow>& batch,
                                             CommitContext* commit) {
  const ShapeRow& row = batch.row;
  const TimeNs to_ns = row.t1 == kTimeMax ? kTimeMax : row.t1 + 1;
  DSG_ASSIGN_OR_RETURN(const auto around, ReadCurrent(kShapes, {row.agent, row.t0, to_ns}, commit));
  std::set<TimeNs> hidden;
  std::vector<TimeNs> times;
  for (const auto& other : around) {
    if (!IsNewer(other, batch)) continue;
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

TimeNs LookBack(TimeNs from_ns) {
  return from_ns < kTimeMin + kShapeBatchNsMax ? kTimeMin : from_ns - kShapeBatchNsMax;
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
  DSG_ASSIGN_OR_RETURN(const auto batches, ReadCurrent(kFactors, span, commit));
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
  DSG_ASSIGN_OR_RETURN(const auto batches, ReadCurrent(kShapes, span, commit));
  for (const auto& batch : batches) DSG_RETURN_IF_ERROR(CutShapeBatch(span, batch, commit));
  return absl::OkStatus();
}

absl::StatusOr<std::string> ShapeReader::LoadPayload(const Segment& segment) {
  Query query(db_,
              "SELECT checksum, payload FROM shape_segment WHERE id = ?1 AND rev_from = ?2"
              " UNION ALL SELECT checksum, payload FROM shape_history"
              " WHERE id = ?1 AND rev_from = ?2");
  const bool found = query.Bind(segment.row_id, segment.rev_from).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (found) {
    const ShapeRow row{{question_.agent, segment.rev_from, segment.t0, segment.t1, query.Blob(1)}};
    if (query.Int(0) == ChecksumOf(row)) return std::string(row.payload);
  }
  return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
}

absl::Status ShapeReader::Reach(Segment segment) {
  DSG_ASSIGN_OR_RETURN(const std::string payload, LoadPayload(segment));
  if (!DecodeShapeTimes(payload, &segment.times)) {
    return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
  }
  const auto first =
      std::lower_bound(segment.times.begin(), segment.times.end(), question_.from_ns);
  segment.next = static_cast<size_t>(first - segment.times.begin());
  if (first != segment.times.end()) reached_.push_back(std::move(segment));
  return absl::OkStatus();
}

TimeNs ShapeReader::NextTime() const {
  TimeNs next_ns = kTimeMax;
  for (const Segment& segment : reached_) {
    next_ns = std::min(next_ns, segment.times[segment.next]);
  }
  return next_ns;
}

const ShapeReader::Segment& ShapeReader::Pass(TimeNs time_ns, size_t* index) {
  const Segment* believed = nullptr;
  for (Segment& segment : reached_) {
    if (segment.times[segment.next] != time_ns) continue;
    if (believed == nullptr || std::tie(segment.rev_from, segment.row_id) >
                                   std::tie(believed->rev_from, believed->row_id)) {
      believed = &segment;
      *index = segment.next;
    }
    ++segment.next;
  }
  return *believed;
}

absl::StatusOr<ShapesPtr> ShapeReader::Decode(const Segment& segment) {
  const ShapeKey key{segment.row_id, segment.rev_from, question_.with_vertices};
  return cache_.Get(key, {}, [&]() -> absl::StatusOr<Costed<ShapesPtr>> {
    DSG_ASSIGN_OR_RETURN(const std::string payload, LoadPayload(segment));
    auto decoded = std::make_shared<DecodedShapes>();
    if (!DecodeShapes(payload, question_.with_vertices, decoded.get())) {
      return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
    }
    const size_t bytes = decoded->memory_bytes();
    return Costed<ShapesPtr>{std::move(decoded), bytes};
  });
}

absl::StatusOr<bool> ShapeReader::Show(const Segment& segment, size_t index, const Visit& visit) {
  if (segment.row_id != decoded_id_ || segment.rev_from != decoded_rev_from_) {
    DSG_ASSIGN_OR_RETURN(decoded_, Decode(segment));
    decoded_id_ = segment.row_id;
    decoded_rev_from_ = segment.rev_from;
  }
  return visit({decoded_->shapes[index], decoded_->vertex_counts[index], decoded_->topology});
}

absl::Status ShapeReader::Read(const StopCheck& stop, const Visit& visit) {
  Query rows(db_,
             "SELECT id, rev_from, t0, t1 FROM shape_segment"
             " WHERE agent = ?1 AND rev_from <= ?2 AND t0 >= ?3 AND t0 < ?5 AND t1 >= ?4"
             " UNION ALL SELECT id, rev_from, t0, t1 FROM shape_history"
             " WHERE agent = ?1 AND rev_from <= ?2 AND rev_to > ?2 AND t0 >= ?3 AND t0 < ?5"
             "  AND t1 >= ?4"
             " ORDER BY t0");
  rows.Bind(KeyOf(question_.agent), question_.revision, LookBack(question_.from_ns),
            question_.from_ns, question_.to_ns);
  bool has_row = rows.Next();
  for (;;) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    // A segment is reached before the first of its times is shown.
    while (has_row && (reached_.empty() || rows.Int(2) <= NextTime())) {
      DSG_RETURN_IF_ERROR(Reach({rows.Int(0), rows.Int(1), rows.Int(2), rows.Int(3), {}}));
      has_row = rows.Next();
    }
    DSG_RETURN_IF_ERROR(rows.status());
    if (reached_.empty() || NextTime() >= question_.to_ns) return absl::OkStatus();
    size_t index = 0;
    const Segment& believed = Pass(NextTime(), &index);
    DSG_ASSIGN_OR_RETURN(const bool goes_on, Show(believed, index, visit));
    if (!goes_on) return absl::OkStatus();
    std::erase_if(reached_, [](const Segment& one) { return one.next == one.times.size(); });
  }
}

}  // namespace dsg::sqlite
