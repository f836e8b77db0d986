// SPDX-License-Identifier: Apache-2.0
// What a span of revisions touched, from the lists that commits leave. Of compacted revisions the
// next one that is kept has the list.
#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/map_reader.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/touched_keys.h"

namespace dsg::sqlite {
namespace {

absl::Status ReadLists(Database& db, Revision after, Revision until, const StopCheck& stop,
                       TouchedKeys* keys) {
  Query query(db,
              "SELECT revision.revision, payload, checksum FROM revision LEFT JOIN touched"
              " USING (revision) WHERE revision.revision > ?1 AND revision.revision <= ?2");
  query.Bind(after, until);
  while (query.Next()) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    const Revision revision = query.Int(0);
    if (query.IsNull(1) || query.Int(2) != RowChecksum({revision}, query.Blob(1)) ||
        !DecodeTouched(query.Blob(1), keys)) {
      return CorruptRow(db.map_name(), "touched", absl::StrCat(revision));
    }
  }
  return query.status();
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

absl::StatusOr<Touched> SqliteMapReader::TouchedBetween(Revision after, Revision until,
                                                        const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(At(after).status());
  DSG_RETURN_IF_ERROR(At(until).status());
  Touched touched;
  if (after >= until) return touched;
  DSG_ASSIGN_OR_RETURN(Lease lease, LeaseAt(until));
  DSG_RETURN_IF_ERROR(CheckStillReadable(*lease, after, generation_));
  TouchedKeys keys;
  DSG_RETURN_IF_ERROR(ReadLists(*lease, after, until, stop, &keys));
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
