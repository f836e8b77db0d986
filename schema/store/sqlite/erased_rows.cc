// SPDX-License-Identifier: Apache-2.0
// Nodes, edges, stays and mesh blocks.
#include "schema/store/sqlite/erased_rows.h"

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/asset_references.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {
namespace {

struct Selection {
  const char* select;
  const char* drop;
};

#define DSG_EDGES_WHERE(condition)                                                 \
  {                                                                                \
    "SELECT source, relation, target, rev_from, rev_to, weight, payload, checksum" \
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
    "SELECT agent, enter_ns, exit_ns, place, room, rev_from, rev_to, checksum" \
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

// Columns: source, relation, target, rev_from, anything, weight, payload, checksum.
absl::StatusOr<RowSums> SumsOfEdge(const Query& query, const std::string& map) {
  const std::initializer_list<int64_t> columns = {query.Int(0), query.Int(1), query.Int(2),
                                                  query.Int(3), BitsOf(query.Real(5))};
  if (query.Int(7) != RowChecksum32(columns, query.Blob(6))) {
    return CorruptRow(
        map, "edge_history",
        absl::StrCat(ToString(IdOf(query.Int(0))), " ", ToString(IdOf(query.Int(2)))));
  }
  RowSums sums;
  sums.content.Add(RowIdentity('E', columns, query.Blob(6)));
  sums.edge_count = 1;
  return sums;
}

template <typename... Values>
absl::Status TakeEdges(const Selection& selection, ErasedRows* erased, const Values&... values) {
  {
    Query query(erased->db, selection.select);
    query.Bind(values...);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const RowSums sums, SumsOfEdge(query, erased->spec.name));
      erased->Take(sums, query.Int(3), query.Int(4), query.Blob(6).size());
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return Query(erased->db, selection.drop).Bind(values...).Run();
}

template <typename... Values>
absl::Status TakeStays(const Selection& selection, ErasedRows* erased, const Values&... values) {
  {
    Query query(erased->db, selection.select);
    query.Bind(values...);
    while (query.Next()) {
      const std::initializer_list<int64_t> columns = {query.Int(0), query.Int(1), query.Int(2),
                                                      query.Int(3), query.Int(4), query.Int(5)};
      if (query.Int(7) != RowChecksum32(columns, "")) {
        return CorruptRow(erased->spec.name, "stay_history",
                          absl::StrCat(ToString(IdOf(query.Int(0))), " ", query.Int(1)));
      }
      RowSums sums;
      sums.content.Add(RowIdentity('S', columns, ""));
      sums.stay_count = 1;
      erased->Take(sums, query.Int(5), query.Int(6), 48);
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return Query(erased->db, selection.drop).Bind(values...).Run();
}

absl::Status TakeVersions(int64_t key, ErasedRows* erased, bool* is_agent) {
  {
    Query query(erased->db,
                "SELECT rev_from, rev_to, layer, payload, checksum FROM node_history"
                " WHERE key = ?1");
    query.Bind(key);
    while (query.Next()) {
      const std::initializer_list<int64_t> columns = {key, query.Int(0), query.Int(2)};
      Node node;
      if (query.Int(4) != RowChecksum(columns, query.Blob(3)) ||
          !DecodeNodePayload(query.Blob(3), &node)) {
        return CorruptRow(erased->spec.name, "node_history", ToString(IdOf(key)));
      }
      RowSums sums;
      sums.content.Add(RowIdentity('N', columns, query.Blob(3)));
      sums.node_count = 1;
      sums.layer_counts[static_cast<LayerId>(query.Int(2))] = 1;
      if (IsAgentKind(node.kind)) sums.agent_count = 1;
      *is_agent = *is_agent || IsAgentKind(node.kind);
      CollectReferences(node, &erased->assets);
      erased->Take(sums, query.Int(0), query.Int(1), query.Blob(3).size());
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  return Query(erased->db, "DELETE FROM node_history WHERE key = ?1").Bind(key).Run();
}

// Edges that stay were believed when the node was another: they begin with what it is now.
absl::Status RaiseEdges(const char* sql, int64_t key, Revision since, ErasedRows* erased) {
  struct Row {
    EdgeRowKey key;
    int64_t checksum;
  };
  std::vector<Row> raised;
  {
    Query query(erased->db, sql);
    query.Bind(key, since);
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(const RowSums sums, SumsOfEdge(query, erased->spec.name));
      erased->past.Take(sums, query.Int(3), kRevisionMax);
      const std::initializer_list<int64_t> columns = {query.Int(0), query.Int(1), query.Int(2),
                                                      since, BitsOf(query.Real(5))};
      RowSums later;
      later.content.Add(RowIdentity('E', columns, query.Blob(6)));
      later.edge_count = 1;
      erased->past.Put(later, since, kRevisionMax);
      const EdgeRowKey edge{IdOf(query.Int(0)), query.Int(1), IdOf(query.Int(2))};
      raised.push_back({edge, RowChecksum32(columns, query.Blob(6))});
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const Row& row : raised) {
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
    erased->past.ForgetEdge({IdOf(query.Int(0)), query.Int(1), IdOf(query.Int(2))}, query.Int(3));
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
  erased->past.ForgetNode(id, since);
  DSG_RETURN_IF_ERROR(TakeEdges(kEdgesFrom, erased, key));
  DSG_RETURN_IF_ERROR(TakeEdges(kEdgesTo, erased, key));
  DSG_RETURN_IF_ERROR(TakeStays(kStaysInRoom, erased, key));
  DSG_RETURN_IF_ERROR(TakeStays(kStaysInPlace, erased, key));
  if (since == 0) {
    // A track may outlive the versions, when the same call was stopped between the two.
    return EraseGoneAgent(id, erased);
  }
  for (const char* sql :
       {"SELECT source, relation, target, rev_from, 0, weight, payload, checksum FROM edge"
        " WHERE source = ?1 AND rev_from < ?2",
        "SELECT source, relation, target, rev_from, 0, weight, payload, checksum FROM edge"
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
  DSG_RETURN_IF_ERROR(TakeEdges(kEdgesBetween, erased, source, key.relation, target));
  Query query(erased->db,
              "SELECT rev_from FROM edge WHERE source = ?1 AND relation = ?2 AND target = ?3");
  const bool is_current = query.Bind(source, key.relation, target).Next();
  DSG_RETURN_IF_ERROR(query.status());
  erased->past.ForgetEdge(key, is_current ? query.Int(0) : 0);
  return absl::OkStatus();
}

absl::Status EraseMeshRows(const BlockIndex& index, ErasedRows* erased) {
  {
    Query query(erased->db,
                "SELECT rev_from, rev_to, payload, checksum FROM mesh_block_history"
                " WHERE x = ?1 AND y = ?2 AND z = ?3");
    query.Bind(index.x, index.y, index.z);
    while (query.Next()) {
      const std::initializer_list<int64_t> columns = {index.x, index.y, index.z, query.Int(0)};
      if (query.Int(3) != RowChecksum(columns, query.Blob(2))) {
        return CorruptRow(erased->spec.name, "mesh_block_history",
                          absl::StrCat(index.x, ",", index.y, ",", index.z));
      }
      RowSums sums;
      sums.content.Add(RowIdentity('M', columns, query.Blob(2)));
      sums.mesh_block_count = 1;
      erased->Take(sums, query.Int(0), query.Int(1), query.Blob(2).size());
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  DSG_RETURN_IF_ERROR(
      Query(erased->db, "DELETE FROM mesh_block_history WHERE x = ?1 AND y = ?2 AND z = ?3")
          .Bind(index.x, index.y, index.z)
          .Run());
  Query current(erased->db, "SELECT rev_from FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3");
  const bool is_current = current.Bind(index.x, index.y, index.z).Next();
  DSG_RETURN_IF_ERROR(current.status());
  erased->past.ForgetMeshBlock(index, is_current ? current.Int(0) : 0);
  return absl::OkStatus();
}

absl::Status EraseStayRows(const TrackSpan& span, ErasedRows* erased) {
  return TakeStays(kStaysOfAgent, erased, KeyOf(span.agent), span.from_ns, span.to_ns);
}

}  // namespace dsg::sqlite
