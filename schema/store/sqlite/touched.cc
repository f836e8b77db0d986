// SPDX-License-Identifier: Apache-2.0
// What a span of revisions touched: from the list that each commit leaves or, in maps made before
// there were such lists, from the rows that begin or end in the span.
#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/map_reader.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/touched_keys.h"

namespace dsg::sqlite {
namespace {

// Rows between two questions to `stop`.
constexpr int kStopPeriod = 512;

absl::Status ReadLists(Database& db, Revision after, Revision until, const StopCheck& stop,
                       TouchedKeys* keys) {
  Query query(db,
              "SELECT revision, payload, checksum FROM touched"
              " WHERE revision > ?1 AND revision <= ?2 ORDER BY revision");
  query.Bind(after, until);
  Revision expected = after;
  while (query.Next()) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const Revision revision = query.Int(0);
    if (revision != ++expected || query.Int(2) != RowChecksum({revision}, query.Blob(1)) ||
        !DecodeTouched(query.Blob(1), keys)) {
      return CorruptRow(db.map_name(), "touched", absl::StrCat(expected));
    }
  }
  DSG_RETURN_IF_ERROR(query.status());
  if (expected == until) return absl::OkStatus();
  return CorruptRow(db.map_name(), "touched", absl::StrCat(expected + 1));
}

// Each text is one statement, so that no commit can move a row past the reader.
template <typename Take>
absl::Status Scan(Database& db, const char* sql, Revision after, Revision until,
                  const StopCheck& stop, const Take& take) {
  Query query(db, sql);
  query.Bind(after, until);
  for (int row = 0; query.Next(); ++row) {
    if (row % kStopPeriod == 0) DSG_RETURN_IF_ERROR(AskStop(stop));
    take(query);
  }
  return query.status();
}

absl::Status ScanRows(Database& db, Revision after, Revision until, const StopCheck& stop,
                      TouchedKeys* keys) {
  DSG_RETURN_IF_ERROR(AskStop(stop));
  DSG_RETURN_IF_ERROR(
      Scan(db,
           "SELECT key FROM node WHERE rev_from > ?1 AND rev_from <= ?2"
           " UNION ALL SELECT key FROM node_history WHERE (rev_from > ?1 AND rev_from <= ?2)"
           "  OR (rev_to > ?1 AND rev_to <= ?2)",
           after, until, stop, [&](const Query& row) { keys->nodes.push_back(IdOf(row.Int(0))); }));
  DSG_RETURN_IF_ERROR(
      Scan(db,
           "SELECT source, relation, target FROM edge WHERE rev_from > ?1 AND rev_from <= ?2"
           " UNION ALL SELECT source, relation, target FROM edge_history"
           "  WHERE (rev_from > ?1 AND rev_from <= ?2) OR (rev_to > ?1 AND rev_to <= ?2)",
           after, until, stop, [&](const Query& row) {
             keys->edges.push_back({IdOf(row.Int(0)), row.Int(1), IdOf(row.Int(2))});
           }));
  DSG_RETURN_IF_ERROR(Scan(
      db,
      "SELECT agent FROM track_mark JOIN track USING (slot) WHERE revision > ?1 AND revision <= ?2",
      after, until, stop, [&](const Query& row) { keys->tracks.push_back(IdOf(row.Int(0))); }));
  DSG_RETURN_IF_ERROR(
      Scan(db,
           "SELECT x, y, z FROM mesh_block WHERE rev_from > ?1 AND rev_from <= ?2"
           " UNION ALL SELECT x, y, z FROM mesh_block_history"
           "  WHERE (rev_from > ?1 AND rev_from <= ?2) OR (rev_to > ?1 AND rev_to <= ?2)",
           after, until, stop, [&](const Query& row) {
             keys->mesh_blocks.push_back({static_cast<int32_t>(row.Int(0)),
                                          static_cast<int32_t>(row.Int(1)),
                                          static_cast<int32_t>(row.Int(2))});
           }));
  return Scan(db,
              "SELECT 1 FROM layer WHERE rev_from > ?1 AND rev_from <= ?2"
              " UNION ALL SELECT 1 FROM label WHERE rev_from > ?1 AND rev_from <= ?2",
              after, until, stop, [&](const Query&) { keys->layers_or_labels = true; });
}

// Tracks of which a segment that the reader at `after` could see has ended.
absl::StatusOr<std::vector<NodeId>> ReadCorrected(Database& db, Revision after, Revision until) {
  Query query(db,
              "SELECT DISTINCT agent FROM trajectory_history JOIN track ON slot = id >> 42"
              " WHERE rev_to > ?1 AND rev_to <= ?2 AND +rev_from <= ?1");
  query.Bind(after, until);
  std::vector<NodeId> agents;
  while (query.Next()) agents.push_back(IdOf(query.Int(0)));
  DSG_RETURN_IF_ERROR(query.status());
  std::sort(agents.begin(), agents.end());
  return agents;
}

// Edges go by the names of their relations, in whose order the answer stands.
absl::StatusOr<std::vector<EdgeKey>> NameEdges(Database& db, std::vector<EdgeRowKey> edges) {
  std::vector<std::string> names;
  std::unordered_map<int64_t, int64_t> rank_of;
  Query query(db, "SELECT id, name FROM relation ORDER BY name");
  while (query.Next()) {
    rank_of[query.Int(0)] = std::ssize(names);
    names.emplace_back(query.Text(1));
  }
  DSG_RETURN_IF_ERROR(query.status());
  for (EdgeRowKey& edge : edges) {
    const auto rank = rank_of.find(edge.relation);
    if (rank == rank_of.end()) {
      return CorruptRow(db.map_name(), "relation", absl::StrCat(edge.relation));
    }
    edge.relation = rank->second;
  }
  std::sort(edges.begin(), edges.end());
  std::vector<EdgeKey> named;
  named.reserve(edges.size());
  for (const EdgeRowKey& edge : edges) {
    named.push_back({edge.source, names[static_cast<size_t>(edge.relation)], edge.target});
  }
  return named;
}

}  // namespace

absl::StatusOr<bool> KeepsTouched(Database& db) {
  DSG_ASSIGN_OR_RETURN(
      const int64_t count,
      db.QueryInt("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = 'touched'"));
  return count == 1;
}

absl::StatusOr<Touched> SqliteMapReader::TouchedBetween(Revision after, Revision until,
                                                        const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(At(after).status());
  DSG_RETURN_IF_ERROR(At(until).status());
  Touched touched;
  if (after >= until) return touched;
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseConnection());
  TouchedKeys keys;
  if (keeps_touched_) {
    DSG_RETURN_IF_ERROR(ReadLists(*lease, after, until, stop, &keys));
  } else {
    DSG_RETURN_IF_ERROR(ScanRows(*lease, after, until, stop, &keys));
  }
  keys.Normalize();
  touched.nodes = std::move(keys.nodes);
  DSG_ASSIGN_OR_RETURN(touched.edges, NameEdges(*lease, std::move(keys.edges)));
  touched.tracks = std::move(keys.tracks);
  if (!touched.tracks.empty()) {
    DSG_ASSIGN_OR_RETURN(touched.corrected_tracks, ReadCorrected(*lease, after, until));
  }
  touched.mesh_blocks = std::move(keys.mesh_blocks);
  touched.layers_or_labels = keys.layers_or_labels;
  return touched;
}

}  // namespace dsg::sqlite
