// SPDX-License-Identifier: Apache-2.0
// Nodes, edges, stays, mesh blocks, shapes and factors. Poses: erased_tracks.cc.
#include "schema/store/sqlite/erased_rows.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/batch_rows.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"
#include "schema/store/track_rules.h"

namespace dsg::sqlite {
namespace {

struct Selection {
  const char* select;
  const char* drop;
};

#define DSG_EDGES_WHERE(condition)                                                 \
  {                                                                                \
    "SELECT source, relation, target, rev_from, weight, payload, checksum, rev_to" \
    " FROM edge_history WHERE " condition,                                         \
        "DELETE FROM edge_history WHERE " condition                                \
  }

constexpr Selection kPastEdgesFrom = DSG_EDGES_WHERE("source = ?1");
constexpr Selection kPastEdgesTo = DSG_EDGES_WHERE("target = ?1");
constexpr Selection kPastEdgesBetween =
    DSG_EDGES_WHERE("source = ?1 AND relation = ?2 AND target = ?3");

#undef DSG_EDGES_WHERE

#define DSG_STAYS_WHERE(condition)                                             \
  {                                                                            \
    "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum, rev_to" \
    " FROM stay_history WHERE " condition,                                     \
        "DELETE FROM stay_history WHERE " condition                            \
  }

constexpr Selection kPastStaysInRoom = DSG_STAYS_WHERE("room = ?1");
constexpr Selection kPastStaysInPlace = DSG_STAYS_WHERE("place = ?1");
// One that was open reached as far as the track when it was believed.
constexpr Selection kPastStaysOfAgent = DSG_STAYS_WHERE(
    "agent = ?1 AND enter_ns < ?3 AND (enter_ns >= ?2 OR min(exit_ns,"
    " coalesce((SELECT last_ns + 1 FROM track_mark WHERE slot ="
    " (SELECT slot FROM track WHERE track.agent = ?1)"
    " AND revision < stay_history.rev_to ORDER BY revision DESC LIMIT 1),"
    " 9223372036854775807)) > ?2)");

#undef DSG_STAYS_WHERE

template <typename Row>
RowSums SumsOf(const Row& row) {
  RowSums sums;
  sums.Add(row);
  return sums;
}

// Takes out the rows of a selection. `read` reads them; behind its columns stands rev_to, in column
// 7 of edges and stays and 6 of mesh blocks.
template <typename Read, typename... Values>
absl::Status TakeRows(const Selection& selection, const Read& read, int rev_to, ErasedRows* erased,
                      const Values&... values) {
  {
    Query query(erased->db, selection.select);
    query.Bind(values...);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const auto row, read(query, erased->spec.name));
      const size_t bytes = sizeof(row.columns()) + row.payload.size();
      erased->Take(SumsOf(row), row.rev_from, query.Int(rev_to), bytes);
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return Query(erased->db, selection.drop).Bind(values...).Run();
}

absl::Status TakeVersions(int64_t key, ErasedRows* erased, bool* is_agent) {
  {
    Query query(erased->db,
                "SELECT key, rev_from, layer, payload, checksum, rev_to FROM node_history"
                " WHERE key = ?1");
    query.Bind(key);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, erased->spec.name));
      const NodeRow row{node.id, node.revision, node.layer, query.Blob(3), IsAgentKind(node.kind)};
      *is_agent = *is_agent || row.is_agent;
      for (const Sha256& asset : AssetsOf(node)) erased->assets.insert(asset);
      erased->Take(SumsOf(row), row.rev_from, query.Int(5), row.payload.size());
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return Query(erased->db, "DELETE FROM node_history WHERE key = ?1").Bind(key).Run();
}

// Edges that stay were believed when the node was another: they begin with what it is now.
absl::Status RaiseEdges(const char* sql, int64_t key, Revision since, ErasedRows* erased) {
  struct Raised {
    EdgeRowKey key;
    int64_t checksum;
  };
  std::vector<Raised> raised;
  {
    Query query(erased->db, sql);
    query.Bind(key, since);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(EdgeRow row, EdgeRowOf(query, erased->spec.name));
      erased->past.Take(SumsOf(row), row.rev_from, kRevisionMax);
      row.rev_from = since;
      erased->past.Put(SumsOf(row), since, kRevisionMax);
      raised.push_back({{row.source, row.relation, row.target}, ChecksumOf(row)});
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const Raised& row : raised) {
    DSG_RETURN_IF_ERROR(Query(erased->db,
                              "UPDATE edge SET rev_from = ?4, checksum = ?5"
                              " WHERE source = ?1 AND relation = ?2 AND target = ?3")
                            .Bind(KeyOf(row.key.source), row.key.relation, KeyOf(row.key.target),
                                  since, row.checksum)
                            .Run());
  }
  return absl::OkStatus();
}

// Current edges at the node, so that the lists of touched keys go on naming them.
absl::Status KeepEdges(const char* sql, int64_t key, ErasedRows* erased) {
  Query query(erased->db, sql);
  query.Bind(key);
  while (query.Next()) {
    erased->past.forgotten.ForgetEdge({IdOf(query.Int(0)), query.Int(1), IdOf(query.Int(2))},
                                      query.Int(3));
  }
  return query.status();
}

absl::StatusOr<Revision> CurrentSince(Database& db, int64_t key) {
  Query query(db, "SELECT rev_from FROM node WHERE key = ?1");
  const bool found = query.Bind(key).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found ? query.Int(0) : 0;
}

absl::Status EraseGoneAgent(NodeId agent, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(EraseStayRows({agent, kTimeMin, kTimeMax}, erased));
  DSG_RETURN_IF_ERROR(EraseAllBatches(agent, erased));
  return EraseTrack(agent, erased);
}

// What is left of a batch of which a part goes: it is written anew in its place, at the same
// revisions. No bytes when nothing is left.
struct BatchRest {
  BatchTimes times;
  std::string payload;
};

// The statements of a table of batches; columns as ReadBatches.
template <typename Row>
struct ErasedBatches {
  const char* name;
  const char* select_all;
  const char* select_span;
  const char* update;
  const char* drop;
};

#define DSG_PAST_BATCHES(table)                                                                \
  {                                                                                            \
    table,                                                                                     \
        "SELECT agent, rev_from, t0, t1, payload, checksum, rowid, rev_to FROM " table         \
        " WHERE agent = ?1",                                                                   \
        "SELECT agent, rev_from, t0, t1, payload, checksum, rowid, rev_to FROM " table         \
        " WHERE agent = ?1 AND t0 < ?3 AND t1 >= ?2",                                          \
        "UPDATE " table " SET t0 = ?2, t1 = ?3, checksum = ?4, payload = ?5 WHERE rowid = ?1", \
        "DELETE FROM " table " WHERE rowid = ?1"                                               \
  }
#define DSG_CURRENT_BATCHES(table)                                                      \
  {                                                                                     \
    table,                                                                              \
        "SELECT agent, rev_from, t0, t1, payload, checksum, rowid, 9223372036854775807" \
        " FROM " table " WHERE agent = ?1",                                             \
        nullptr, nullptr, "DELETE FROM " table " WHERE rowid = ?1"                      \
  }

constexpr ErasedBatches<ShapeRow> kPastShapes = DSG_PAST_BATCHES("shape_history");
constexpr ErasedBatches<FactorRow> kPastFactors = DSG_PAST_BATCHES("factor_history");
constexpr ErasedBatches<ShapeRow> kCurrentShapes = DSG_CURRENT_BATCHES("shape_segment");
constexpr ErasedBatches<FactorRow> kCurrentFactors = DSG_CURRENT_BATCHES("factor_segment");

#undef DSG_PAST_BATCHES
#undef DSG_CURRENT_BATCHES

void CollectTopology(const StoredBatch<ShapeRow>& batch, ErasedRows* erased) {
  std::optional<Sha256> topology;
  if (DecodeShapeTopology(batch.payload, &topology) && topology.has_value()) {
    erased->assets.insert(*topology);
  }
}
void CollectTopology(const StoredBatch<FactorRow>& /*batch*/, ErasedRows* /*erased*/) {}

// Nullopt if nothing of the batch lies in the span.
absl::StatusOr<std::optional<BatchRest>> CutOut(const TrackSpan& span,
                                                const StoredBatch<ShapeRow>& batch,
                                                const MapSpec& spec) {
  DecodedShapes decoded;
  if (!DecodeShapes(batch.payload, /*with_vertices=*/true, &decoded)) {
    return CorruptRow(spec.name, kPastShapes.name, ToString(span.agent));
  }
  ShapeAppend rest{span.agent, decoded.topology, std::move(decoded.shapes)};
  const auto gone = std::erase_if(
      rest.shapes, [&](const BodyShape& shape) { return Holds(span, shape.time_ns); });
  if (gone == 0) return std::optional<BatchRest>();
  if (rest.shapes.empty()) return std::optional<BatchRest>(BatchRest());
  return std::optional<BatchRest>(BatchRest{
      {rest.shapes.front().time_ns, rest.shapes.back().time_ns}, EncodeShapes(rest, spec.codec)});
}

absl::StatusOr<std::optional<BatchRest>> CutOut(const TrackSpan& span,
                                                const StoredBatch<FactorRow>& batch,
                                                const MapSpec& spec) {
  std::vector<PoseFactor> factors;
  if (!DecodeFactors(batch.payload, &factors)) {
    return CorruptRow(spec.name, kPastFactors.name, ToString(span.agent));
  }
  const auto gone =
      std::erase_if(factors, [&](const PoseFactor& factor) { return Touches(factor, span); });
  if (gone == 0) return std::optional<BatchRest>();
  if (factors.empty()) return std::optional<BatchRest>(BatchRest());
  return std::optional<BatchRest>(BatchRest{TimesOf(factors), EncodeFactors(factors)});
}

template <typename Row>
void Take(const StoredBatch<Row>& batch, ErasedRows* erased) {
  erased->Take(SumsOf(batch.Whole()), batch.row.rev_from, batch.rev_to, batch.payload.size());
  CollectTopology(batch, erased);
}

template <typename Row>
absl::Status Replace(const ErasedBatches<Row>& table, const StoredBatch<Row>& batch,
                     const BatchRest& rest, ErasedRows* erased) {
  Take(batch, erased);
  if (rest.payload.empty()) return Query(erased->db, table.drop).Bind(batch.row_id).Run();
  Row left = batch.row;
  left.t0 = rest.times.t0;
  left.t1 = rest.times.t1;
  left.payload = rest.payload;
  erased->past.Put(SumsOf(left), left.rev_from, batch.rev_to);
  return Query(erased->db, table.update)
      .Bind(batch.row_id, left.t0, left.t1, ChecksumOf(left), Query::BlobView{rest.payload})
      .Run();
}

template <typename Row>
absl::Status CutBatches(const ErasedBatches<Row>& table, const TrackSpan& span,
                        ErasedRows* erased) {
  std::vector<std::pair<StoredBatch<Row>, BatchRest>> touched;
  {
    Query query(erased->db, table.select_span);
    query.Bind(KeyOf(span.agent), span.from_ns, span.to_ns);
    DSG_ASSIGN_OR_RETURN(auto batches, ReadBatches<Row>(&query, erased->spec.name));
    for (StoredBatch<Row>& batch : batches) {
      DSG_ASSIGN_OR_RETURN(std::optional<BatchRest> rest, CutOut(span, batch, erased->spec));
      if (rest.has_value()) touched.emplace_back(std::move(batch), *std::move(rest));
    }
  }
  for (const auto& [batch, rest] : touched) {
    DSG_RETURN_IF_ERROR(Replace(table, batch, rest, erased));
  }
  return absl::OkStatus();
}

template <typename Row>
absl::Status TakeBatches(const ErasedBatches<Row>& table, NodeId agent, ErasedRows* erased) {
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

void PastChange::Take(const RowSums& row, Revision from, Revision to) {
  changes_[from] -= row;
  if (to != kRevisionMax) changes_[to] += row;
}

void PastChange::Put(const RowSums& row, Revision from, Revision to) {
  changes_[from] += row;
  if (to != kRevisionMax) changes_[to] -= row;
}

absl::Status PastChange::Apply(Database& db) const {
  DSG_RETURN_IF_ERROR(ApplySums(db));
  DSG_ASSIGN_OR_RETURN(const bool lists_changed, ApplyToLists(db));
  // Readers need not begin again when there was nothing to forget.
  if (changes_.empty() && !lists_changed) return absl::OkStatus();
  return Query(db, "UPDATE map SET generation = generation + 1").Run();
}

absl::Status PastChange::ApplySums(Database& db) const {
  if (changes_.empty()) return absl::OkStatus();
  auto change = changes_.begin();
  RowSums sums;
  Sha256 parent{};
  // As it stands there: a new digest over a record that is damaged would say that it is sound.
  Sha256 stored_parent{};
  Revision before = 0;
  std::vector<RevisionRecord> changed;
  Query query(db, "SELECT " DSG_REVISION_COLUMNS ", parent_digest FROM revision ORDER BY revision");
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, db.map_name()));
    const Revision revision = head.info.revision;
    if (revision != before + 1) {
      const std::optional<Sha256> stored = ParentFromRow(query);
      if (!stored.has_value()) {
        return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
      }
      parent = *stored;
      stored_parent = parent;
    }
    if (DigestOf(stored_parent, head) != head.info.digest) {
      return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
    }
    stored_parent = head.info.digest;
    before = revision;
    for (; change != changes_.end() && change->first <= revision; ++change) sums += change->second;
    if (revision >= changes_.begin()->first) {
      head.sums += sums;
      Seal(parent, &head);
      changed.push_back(head);
    }
    parent = head.info.digest;
  }
  DSG_RETURN_IF_ERROR(query.status());
  query.Reset();
  for (const RevisionRecord& head : changed) DSG_RETURN_IF_ERROR(UpdateRevision(db, head));
  return absl::OkStatus();
}

absl::StatusOr<bool> PastChange::ApplyToLists(Database& db) const {
  std::vector<std::pair<Revision, TouchedKeys>> changed;
  {
    Query query(db,
                "SELECT revision.revision, payload, checksum FROM revision LEFT JOIN touched"
                " USING (revision) ORDER BY revision.revision");
    for (Revision before = 0; query.Next(); before = query.Int(0)) {
      // The first one of a compacted map has no list.
      if (query.IsNull(1)) continue;
      TouchedKeys keys;
      DSG_RETURN_IF_ERROR(TouchedFromRow(query, db.map_name(), &keys));
      if (forgotten.Edit(before, query.Int(0), &keys)) {
        changed.emplace_back(query.Int(0), std::move(keys));
      }
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (auto& [revision, keys] : changed) {
    DSG_RETURN_IF_ERROR(UpdateTouched(db, revision, &keys));
  }
  return !changed.empty();
}

void ErasedRows::Take(const RowSums& sums, Revision from, Revision to, size_t payload_bytes) {
  past.Take(sums, from, to);
  ++row_count;
  byte_count += static_cast<int64_t>(payload_bytes);
}

absl::Status EraseNodeRows(NodeId id, ErasedRows* erased) {
  const int64_t key = KeyOf(id);
  bool is_agent = false;
  DSG_RETURN_IF_ERROR(TakeVersions(key, erased, &is_agent));
  DSG_ASSIGN_OR_RETURN(const Revision since, CurrentSince(erased->db, key));
  erased->past.forgotten.ForgetNode(id, since);
  DSG_RETURN_IF_ERROR(TakeRows(kPastEdgesFrom, EdgeRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kPastEdgesTo, EdgeRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kPastStaysInRoom, StayRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kPastStaysInPlace, StayRowOf, 7, erased, key));
  if (since == 0) {
    // A track may outlive the versions, when the same call was stopped between the two.
    return EraseGoneAgent(id, erased);
  }
  for (const char* sql :
       {"SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
        " WHERE source = ?1 AND rev_from < ?2",
        "SELECT source, relation, target, rev_from, weight, payload, checksum FROM edge"
        " WHERE target = ?1 AND rev_from < ?2"}) {
    DSG_RETURN_IF_ERROR(RaiseEdges(sql, key, since, erased));
  }
  for (const char* sql :
       {"SELECT source, relation, target, rev_from FROM edge WHERE source = ?1",
        "SELECT source, relation, target, rev_from FROM edge WHERE target = ?1"}) {
    DSG_RETURN_IF_ERROR(KeepEdges(sql, key, erased));
  }
  return absl::OkStatus();
}

absl::Status EraseEdgeRows(const EdgeRowKey& key, ErasedRows* erased) {
  const int64_t source = KeyOf(key.source);
  const int64_t target = KeyOf(key.target);
  DSG_RETURN_IF_ERROR(
      TakeRows(kPastEdgesBetween, EdgeRowOf, 7, erased, source, key.relation, target));
  Query query(erased->db,
              "SELECT rev_from FROM edge WHERE source = ?1 AND relation = ?2 AND target = ?3");
  const bool is_current = query.Bind(source, key.relation, target).Next();
  DSG_RETURN_IF_ERROR(query.status());
  erased->past.forgotten.ForgetEdge(key, is_current ? query.Int(0) : 0);
  return absl::OkStatus();
}

absl::Status EraseMeshRows(const BlockIndex& index, ErasedRows* erased) {
  constexpr Selection kBlock = {
      "SELECT x, y, z, rev_from, payload, checksum, rev_to FROM mesh_block_history"
      " WHERE x = ?1 AND y = ?2 AND z = ?3",
      "DELETE FROM mesh_block_history WHERE x = ?1 AND y = ?2 AND z = ?3"};
  DSG_RETURN_IF_ERROR(TakeRows(kBlock, MeshRowOf, 6, erased, index.x, index.y, index.z));
  Query current(erased->db, "SELECT rev_from FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3");
  const bool is_current = current.Bind(index.x, index.y, index.z).Next();
  DSG_RETURN_IF_ERROR(current.status());
  erased->past.forgotten.ForgetMeshBlock(index, is_current ? current.Int(0) : 0);
  return absl::OkStatus();
}

absl::Status EraseStayRows(const TrackSpan& span, ErasedRows* erased) {
  return TakeRows(kPastStaysOfAgent, StayRowOf, 7, erased, KeyOf(span.agent), span.from_ns,
                  span.to_ns);
}

absl::Status EraseBatchRows(const TrackSpan& span, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(CutBatches(kPastShapes, span, erased));
  return CutBatches(kPastFactors, span, erased);
}

absl::Status EraseAllBatches(NodeId agent, ErasedRows* erased) {
  DSG_RETURN_IF_ERROR(TakeBatches(kPastShapes, agent, erased));
  DSG_RETURN_IF_ERROR(TakeBatches(kPastFactors, agent, erased));
  DSG_RETURN_IF_ERROR(TakeBatches(kCurrentShapes, agent, erased));
  return TakeBatches(kCurrentFactors, agent, erased);
}

}  // namespace dsg::sqlite
