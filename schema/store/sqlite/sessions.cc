// SPDX-License-Identifier: Apache-2.0
// How far each session got. Kept apart from the revisions, which may be compacted away.
#include "schema/store/sqlite/sessions.h"

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

absl::Status WriteSession(Database& db, const RevisionInfo& info) {
  return Query(db,
               "INSERT INTO session (session_id, last_sequence, last_revision, first_revision)"
               " VALUES (?1, ?2, ?3, ?3) ON CONFLICT (session_id) DO UPDATE"
               " SET last_sequence = ?2, last_revision = ?3")
      .Bind(info.session_id, info.sequence, info.revision)
      .Run();
}

absl::StatusOr<std::optional<CommitResult>> FindCommitted(Database& db,
                                                          const std::string& session_id,
                                                          int64_t sequence) {
  Query query(db, "SELECT revision FROM revision WHERE session_id = ?1 AND sequence = ?2");
  const bool found = query.Bind(session_id, sequence).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (found) return std::optional<CommitResult>(CommitResult{query.Int(0), true});
  // Its revision may be compacted away; the session's last one holds it as well.
  DSG_ASSIGN_OR_RETURN(const SessionState session, ReadSession(db, session_id));
  if (sequence > session.last_sequence) return std::optional<CommitResult>();
  return std::optional<CommitResult>(CommitResult{session.last_revision, true});
}

}  // namespace dsg::sqlite
