// SPDX-License-Identifier: Apache-2.0
// What is kept of commits: records of revisions, lists of what they touched, sessions, tags, and
// which revisions can be read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/commit_protocol.h"
#include "schema/store/map_writer.h"
#include "schema/store/readable.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// Columns of the revision table in the order that HeadFromRow reads.
#define DSG_REVISION_COLUMNS                                                        \
  "revision, digest, content, committed_ns, author, message, session_id, sequence," \
  " config_digest, node_count, edge_count, agent_count, pose_count, stay_count,"    \
  " mesh_block_count, first_pose_ns, last_pose_ns, layer_counts"
/// Errors: DATA_LOSS/STORE_CORRUPT.
absl::StatusOr<RevisionRecord> HeadFromRow(const Query& query, const std::string& map);
/// Of the column parent_digest, behind those; nullopt if it holds no digest.
std::optional<Sha256> ParentFromRow(const Query& query);

/// The head as stored; revision 0 for an empty map.
absl::StatusOr<RevisionRecord> LoadHead(Database& db);
/// Errors: DATA_LOSS/STORE_CORRUPT if there is no such record.
absl::StatusOr<RevisionRecord> LoadRevision(Database& db, Revision revision);
/// Newest first, before `before`.
absl::StatusOr<std::vector<RevisionInfo>> ReadRevisions(Database& db, Revision before, int limit);
/// The record and its session.
absl::Status InsertRevision(const CommitContext& commit);
/// The record alone. `parent` is set where the revision before has no record.
absl::Status InsertRecord(Database& db, const RevisionRecord& record,
                          std::optional<int64_t> delta_checksum,
                          const std::optional<Sha256>& parent);
/// Writes digest, content, counts and times of a record that is there.
absl::Status UpdateRevision(Database& db, const RevisionRecord& head);

/// Columns: revision, payload, checksum of a list of touched keys, which are added to `keys`.
/// Errors: DATA_LOSS/STORE_CORRUPT, also for a row that is NULL.
absl::Status TouchedFromRow(const Query& query, const std::string& map, TouchedKeys* keys);
/// Normalizes `keys`.
absl::Status InsertTouched(Database& db, Revision revision, TouchedKeys* keys);
absl::Status UpdateTouched(Database& db, Revision revision, TouchedKeys* keys);
/// One row a key and revision that began or ended a row of that key, whatever the number of rows:
/// kind (N, E, M, T, L), three numbers of its key, revision. What lists of touched keys must say.
inline constexpr char kTouchedRows[] =
    "SELECT 'N', key, 0, 0, rev_from FROM node"
    " UNION SELECT 'N', key, 0, 0, rev_from FROM node_history"
    " UNION SELECT 'N', key, 0, 0, rev_to FROM node_history"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge"
    " UNION SELECT 'E', source, relation, target, rev_from FROM edge_history"
    " UNION SELECT 'E', source, relation, target, rev_to FROM edge_history"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block"
    " UNION SELECT 'M', x, y, z, rev_from FROM mesh_block_history"
    " UNION SELECT 'M', x, y, z, rev_to FROM mesh_block_history"
    " UNION SELECT 'T', agent, 0, 0, revision FROM track_mark JOIN track USING (slot)"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM layer WHERE rev_from > 0"
    " UNION SELECT 'L', 0, 0, 0, rev_from FROM label";

/// All zero for a session that has committed nothing.
absl::StatusOr<SessionState> ReadSession(Database& db, const std::string& session_id);

/// nullopt if the delta is new.
absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(Database& db,
                                                            const std::string& session_id,
                                                            int64_t sequence);

/// What was erased must not be told from its checksum.
absl::Status ForgetDeltaChecksums(Database& db);

/// Order: by name.
absl::StatusOr<std::vector<Tag>> ReadTags(Database& db);

/// Errors: as CheckTagBounds.
absl::Status WriteTag(Database& db, const Tag& tag);

/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::Status DeleteTag(Database& db, const std::string& name);

absl::StatusOr<Readable> LoadReadable(Database& db);

/// Fails unless the revision can (still) be read. Within a read transaction: as all of it does.
/// Errors: OUT_OF_RANGE/REVISION_COMPACTED; ABORTED/MAP_REPLACED if the generation is another.
absl::Status CheckStillReadable(Database& db, Revision revision, int64_t generation);

}  // namespace dsg::sqlite
