// SPDX-License-Identifier: Apache-2.0
// How far each session got. Kept apart from the revisions, which may be compacted away.
#include "schema/store/sqlite/sessions.h"

#include "schema/base/status.h"

namespace dsg::sqlite {

absl::StatusOr<SessionState> ReadSession(Database& db, const std::string& session_id) {
  Query query(db,
              "SELECT last_sequence, last_revision, first_revision FROM session"
              " WHERE session_id = ?1");
  SessionState state;
  if (query.Bind(session_id).Next()) {
    state = {query.Int(0), query.Int(1), query.Int(2)};
  }
  DSG_RETURN_IF_ERROR(query.status());
  return state;
}

absl::Status WriteSession(Database& db, const RevisionInfo& info, int64_t delta_checksum) {
  return Query(db,
               "INSERT INTO session"
               " (session_id, last_sequence, last_revision, first_revision, last_checksum)"
               " VALUES (?1, ?2, ?3, ?3, ?4) ON CONFLICT (session_id) DO UPDATE"
               " SET last_sequence = ?2, last_revision = ?3, last_checksum = ?4")
      .Bind(info.session_id, info.sequence, info.revision, delta_checksum)
      .Run();
}

absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(Database& db,
                                                            const std::string& session_id,
                                                            int64_t sequence) {
  // The revision may be compacted away; the session's last one holds the delta as well.
  Query query(db,
              "SELECT revision, delta_checksum FROM revision WHERE session_id = ?1 AND"
              " sequence = ?2 UNION ALL SELECT last_revision, CASE WHEN last_sequence = ?2 THEN"
              " last_checksum END FROM session WHERE session_id = ?1 AND last_sequence >= ?2");
  const bool found = query.Bind(session_id, sequence).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<CommittedDelta>();
  CommittedDelta committed{query.Int(0), std::nullopt};
  if (!query.IsNull(1)) committed.checksum = query.Int(1);
  return std::optional<CommittedDelta>(committed);
}

absl::Status ForgetDeltaChecksums(Database& db) {
  DSG_RETURN_IF_ERROR(
      db.Execute("UPDATE revision SET delta_checksum = NULL WHERE delta_checksum IS NOT NULL"));
  return db.Execute("UPDATE session SET last_checksum = NULL WHERE last_checksum IS NOT NULL");
}

}  // namespace dsg::sqlite
