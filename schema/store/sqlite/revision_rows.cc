// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/revision_rows.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/tags.h"

namespace dsg::sqlite {
namespace {

// How far each session got is kept apart from the revisions, which may be compacted away.
absl::Status WriteSession(Database& db, const RevisionInfo& info, int64_t delta_checksum) {
  return Query(db,
               "INSERT INTO session"
               " (session_id, last_sequence, last_revision, first_revision, last_checksum)"
               " VALUES (?1, ?2, ?3, ?3, ?4) ON CONFLICT (session_id) DO UPDATE"
               " SET last_sequence = ?2, last_revision = ?3, last_checksum = ?4")
      .Bind(info.session_id, info.sequence, info.revision, delta_checksum)
      .Run();
}

}  // namespace

absl::StatusOr<RevisionRecord> HeadFromRow(const Query& query, const std::string& map) {
  RevisionRecord head;
  RevisionInfo& info = head.info;
  info.revision = query.Int(0);
  const std::string_view digest = query.Blob(1);
  const std::string_view content = query.Blob(2);
  if (digest.size() != info.digest.size() || content.size() != 16 ||
      !ParseLayerCounts(query.Text(17), &head.sums.layer_counts)) {
    return CorruptRow(map, "revision", absl::StrCat(info.revision));
  }
  std::copy(digest.begin(), digest.end(), info.digest.begin());
  head.sums.content = ContentDigest::FromBytes(content);
  info.committed_ns = query.Int(3);
  info.author = query.Text(4);
  info.message = query.Text(5);
  info.session_id = query.Text(6);
  info.sequence = query.Int(7);
  info.config_digest = query.Text(8);
  head.sums.node_count = query.Int(9);
  head.sums.edge_count = query.Int(10);
  head.sums.agent_count = query.Int(11);
  head.sums.pose_count = query.Int(12);
  head.sums.stay_count = query.Int(13);
  head.sums.mesh_block_count = query.Int(14);
  FillCounts(&head);
  if (!query.IsNull(15)) head.first_pose_ns = query.Int(15);
  if (!query.IsNull(16)) head.last_pose_ns = query.Int(16);
  return head;
}

std::optional<Sha256> ParentFromRow(const Query& query) {
  constexpr int kParentColumn = 18;
  Sha256 parent{};
  const std::string_view bytes = query.Blob(kParentColumn);
  if (bytes.size() != parent.size()) return std::nullopt;
  std::copy(bytes.begin(), bytes.end(), parent.begin());
  return parent;
}

absl::StatusOr<RevisionRecord> LoadHead(Database& db) {
  Query query(db, "SELECT " DSG_REVISION_COLUMNS " FROM revision ORDER BY revision DESC LIMIT 1");
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return RevisionRecord();
  return HeadFromRow(query, db.map_name());
}

absl::StatusOr<RevisionRecord> LoadRevision(Database& db, Revision revision) {
  Query query(db, "SELECT " DSG_REVISION_COLUMNS " FROM revision WHERE revision = ?1");
  const bool found = query.Bind(revision).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
  return HeadFromRow(query, db.map_name());
}

absl::StatusOr<std::vector<RevisionInfo>> ReadRevisions(Database& db, Revision before, int limit) {
  Query query(db, "SELECT " DSG_REVISION_COLUMNS
                  " FROM revision WHERE revision < ?1 ORDER BY revision DESC LIMIT ?2");
  query.Bind(before, limit);
  std::vector<RevisionInfo> revisions;
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, db.map_name()));
    revisions.push_back(std::move(head.info));
  }
  DSG_RETURN_IF_ERROR(query.status());
  return revisions;
}

absl::Status InsertRevision(const CommitContext& commit) {
  DSG_RETURN_IF_ERROR(WriteSession(commit.db, commit.head.info, commit.delta_checksum));
  return InsertRecord(commit.db, commit.head, commit.delta_checksum, std::nullopt);
}

absl::Status InsertRecord(Database& db, const RevisionRecord& record,
                          std::optional<int64_t> delta_checksum,
                          const std::optional<Sha256>& parent) {
  const RevisionInfo& info = record.info;
  const std::string content = record.sums.content.bytes();
  const std::string layer_counts = FormatLayerCounts(record.sums.layer_counts);
  std::optional<Query::BlobView> parent_digest;
  if (parent.has_value()) parent_digest = Query::BlobView{BytesOf(*parent)};
  return Query(db,
               "INSERT INTO revision (" DSG_REVISION_COLUMNS
               ", delta_checksum, parent_digest) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10,"
               " ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20)")
      .Bind(info.revision, Query::BlobView{BytesOf(info.digest)}, Query::BlobView{content},
            info.committed_ns, info.author, info.message, info.session_id, info.sequence,
            info.config_digest, info.node_count, info.edge_count, info.agent_count, info.pose_count,
            info.stay_count, info.mesh_block_count, record.first_pose_ns, record.last_pose_ns,
            layer_counts, delta_checksum, parent_digest)
      .Run();
}

absl::Status UpdateRevision(Database& db, const RevisionRecord& head) {
  const RevisionInfo& info = head.info;
  const std::string content = head.sums.content.bytes();
  return Query(db,
               "UPDATE revision SET digest = ?2, content = ?3, node_count = ?4, edge_count = ?5,"
               " agent_count = ?6, pose_count = ?7, stay_count = ?8, mesh_block_count = ?9,"
               " first_pose_ns = ?10, last_pose_ns = ?11, layer_counts = ?12 WHERE revision = ?1")
      .Bind(info.revision, Query::BlobView{BytesOf(info.digest)}, Query::BlobView{content},
            info.node_count, info.edge_count, info.agent_count, info.pose_count, info.stay_count,
            info.mesh_block_count, head.first_pose_ns, head.last_pose_ns,
            FormatLayerCounts(head.sums.layer_counts))
      .Run();
}

absl::Status TouchedFromRow(const Query& query, const std::string& map, TouchedKeys* keys) {
  const Revision revision = query.Int(0);
  const bool is_sound = !query.IsNull(1) &&
                        query.Int(2) == RowChecksum({revision}, query.Blob(1)) &&
                        DecodeTouched(query.Blob(1), keys);
  return is_sound ? absl::OkStatus() : CorruptRow(map, "touched", absl::StrCat(revision));
}

absl::Status InsertTouched(Database& db, Revision revision, TouchedKeys* keys) {
  keys->Normalize();
  const std::string payload = EncodeTouched(*keys);
  return Query(db, "INSERT INTO touched (revision, payload, checksum) VALUES (?1, ?2, ?3)")
      .Bind(revision, Query::BlobView{payload}, RowChecksum({revision}, payload))
      .Run();
}

absl::Status UpdateTouched(Database& db, Revision revision, TouchedKeys* keys) {
  keys->Normalize();
  const std::string payload = EncodeTouched(*keys);
  return Query(db, "UPDATE touched SET payload = ?2, checksum = ?3 WHERE revision = ?1")
      .Bind(revision, Query::BlobView{payload}, RowChecksum({revision}, payload))
      .Run();
}

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

absl::StatusOr<std::vector<Tag>> ReadTags(Database& db) {
  Query query(db, "SELECT name, revision, created_ns, note FROM tag ORDER BY name");
  std::vector<Tag> tags;
  while (query.Next()) {
    tags.push_back(
        {std::string(query.Text(0)), query.Int(1), query.Int(2), std::string(query.Text(3))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return tags;
}

absl::Status WriteTag(Database& db, const Tag& tag) {
  {
    Query others(db,
                 "SELECT count(*), coalesce(sum(length(CAST(note AS BLOB))), 0) FROM tag"
                 " WHERE name <> ?1");
    const bool found = others.Bind(tag.name).Next();
    DSG_RETURN_IF_ERROR(others.status());
    if (found) {
      DSG_RETURN_IF_ERROR(CheckTagBounds(db.map_name(), tag, others.Int(0), others.Int(1)));
    }
  }
  return Query(db,
               "INSERT INTO tag (name, revision, created_ns, note) VALUES (?1, ?2, ?3, ?4)"
               " ON CONFLICT (name) DO UPDATE SET revision = ?2, created_ns = ?3, note = ?4")
      .Bind(tag.name, tag.revision, tag.created_ns, tag.note)
      .Run();
}

absl::Status DeleteTag(Database& db, const std::string& name) {
  DSG_ASSIGN_OR_RETURN(const auto tags, ReadTags(db));
  const bool is_there =
      std::any_of(tags.begin(), tags.end(), [&](const Tag& tag) { return tag.name == name; });
  if (is_there) return Query(db, "DELETE FROM tag WHERE name = ?1").Bind(name).Run();
  return UnknownTag(db.map_name(), name, tags);
}

absl::StatusOr<Readable> LoadReadable(Database& db) {
  Readable readable;
  Query map(db, "SELECT oldest_revision, generation FROM map");
  if (map.Next()) {
    readable.oldest = map.Int(0);
    readable.generation = map.Int(1);
  }
  DSG_RETURN_IF_ERROR(map.status());
  Query tags(db, "SELECT DISTINCT revision FROM tag ORDER BY revision");
  while (tags.Next()) readable.tagged.push_back(tags.Int(0));
  DSG_RETURN_IF_ERROR(tags.status());
  return readable;
}

absl::Status CheckStillReadable(Database& db, Revision revision, int64_t generation) {
  {
    Query query(db, "SELECT oldest_revision, generation FROM map");
    const bool found = query.Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (found && query.Int(1) == generation && query.Int(0) <= revision) return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(db));
  if (readable.generation != generation) return RewrittenError(db.map_name());
  if (readable.Holds(revision)) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const int64_t newest, db.QueryInt("SELECT max(revision) FROM revision"));
  return CheckReadable(db.map_name(), revision, newest, readable);
}

}  // namespace dsg::sqlite
