// SPDX-License-Identifier: Apache-2.0
// Nodes, edges, stays and mesh blocks.
#include "schema/store/sqlite/erased_rows.h"

#include "schema/store/sqlite/asset_references.h"
#include "schema/store/sqlite/commit.h"
#include "schema/store/sqlite/graph_rows.h"

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

constexpr Selection kEdgesFrom = DSG_EDGES_WHERE("source = ?1");
constexpr Selection kEdgesTo = DSG_EDGES_WHERE("target = ?1");
constexpr Selection kEdgesBetween =
    DSG_EDGES_WHERE("source = ?1 AND relation = ?2 AND target = ?3");

#undef DSG_EDGES_WHERE

#define DSG_STAYS_WHERE(condition)                                             \
  {                                                                            \
    "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum, rev_to" \
    " FROM stay_history WHERE " condition,                                     \
        "DELETE FROM stay_history WHERE " condition                            \
  }

constexpr Selection kStaysInRoom = DSG_STAYS_WHERE("room = ?1");
constexpr Selection kStaysInPlace = DSG_STAYS_WHERE("place = ?1");
// One that was open reached as far as the track when it was believed.
constexpr Selection kStaysOfAgent = DSG_STAYS_WHERE(
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
      CollectReferences(node, &erased->assets);
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

}  // namespace

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
  DSG_RETURN_IF_ERROR(TakeRows(kEdgesFrom, EdgeRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kEdgesTo, EdgeRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kStaysInRoom, StayRowOf, 7, erased, key));
  DSG_RETURN_IF_ERROR(TakeRows(kStaysInPlace, StayRowOf, 7, erased, key));
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
  DSG_RETURN_IF_ERROR(TakeRows(kEdgesBetween, EdgeRowOf, 7, erased, source, key.relation, target));
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
  return TakeRows(kStaysOfAgent, StayRowOf, 7, erased, KeyOf(span.agent), span.from_ns, span.to_ns);
}

}  // namespace dsg::sqlite
