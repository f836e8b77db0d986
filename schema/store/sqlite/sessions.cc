// SPDX-License-Identifier: Apache-2.0
// How far each session got. Kept apart from the revisions, which may be compacted away.
#include "schema/store/sqlite/sessions.h"

#include "absl/strings/str_cat.h"
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

absl::StatusOr<std::optional<CommitResult>> FindCommitted(Database& db,
                                                          const DeltaIdentity& delta) {
  // The revision may be compacted away; the session's last one holds the delta as well.
  Query query(db,
              "SELECT revision, delta_checksum FROM revision WHERE session_id = ?1 AND"
              " sequence = ?2 UNION ALL SELECT last_revision, CASE WHEN last_sequence = ?2 THEN"
              " last_checksum END FROM session WHERE session_id = ?1 AND last_sequence >= ?2");
  const bool found = query.Bind(delta.session_id, delta.sequence).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<CommitResult>();
  const Revision revision = query.Int(0);
  if (query.IsNull(1) || query.Int(1) == delta.checksum) {
    return std::optional<CommitResult>(CommitResult{revision, true});
  }
  return MakeError(
      Reason::kSequenceReused,
      absl::StrCat("sequence ", delta.sequence, " of session ", delta.session_id, " of map \"",
                   db.map_name(), "\" was committed with other content, as revision ", revision,
                   ", and nothing was written now; send what is new under the session's next "
                   "sequence, or begin a session of another name"),
      {{"map", db.map_name()},
       {"session_id", delta.session_id},
       {"sequence", absl::StrCat(delta.sequence)},
       {"revision", absl::StrCat(revision)}});
}

absl::Status ForgetDeltaChecksums(Database& db) {
  DSG_RETURN_IF_ERROR(
      db.Execute("UPDATE revision SET delta_checksum = NULL WHERE delta_checksum IS NOT NULL"));
  return db.Execute("UPDATE session SET last_checksum = NULL WHERE last_checksum IS NOT NULL");
}

}  // namespace dsg::sqlite
