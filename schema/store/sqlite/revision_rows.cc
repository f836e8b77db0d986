// SPDX-License-Identifier: Apache-2.0
// The revision table: one row a commit, each sealed by a digest over the one before.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/sessions.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

constexpr char kSelectNewest[] =
    "SELECT " DSG_REVISION_COLUMNS " FROM revision ORDER BY revision DESC LIMIT 1";

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

absl::StatusOr<RevisionRecord> LoadHead(Database& db) {
  Query query(db, kSelectNewest);
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return RevisionRecord();
  return HeadFromRow(query, db.map_name());
}

absl::Status InsertRevision(const CommitContext& commit) {
  const RevisionInfo& info = commit.head.info;
  DSG_RETURN_IF_ERROR(WriteSession(commit.db, info, commit.delta_checksum));
  const std::string content = commit.head.sums.content.bytes();
  return Query(commit.db,
               "INSERT INTO revision (" DSG_REVISION_COLUMNS
               ", delta_checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13,"
               " ?14, ?15, ?16, ?17, ?18, ?19)")
      .Bind(info.revision, Query::BlobView{BytesOf(info.digest)}, Query::BlobView{content},
            info.committed_ns, info.author, info.message, info.session_id, info.sequence,
            info.config_digest, info.node_count, info.edge_count, info.agent_count, info.pose_count,
            info.stay_count, info.mesh_block_count, commit.head.first_pose_ns,
            commit.head.last_pose_ns, FormatLayerCounts(commit.head.sums.layer_counts),
            commit.delta_checksum)
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

absl::Status InsertTouched(CommitContext* commit) {
  commit->touched.Normalize();
  const std::string payload = EncodeTouched(commit->touched);
  return Query(commit->db, "INSERT INTO touched (revision, payload, checksum) VALUES (?1, ?2, ?3)")
      .Bind(commit->revision(), Query::BlobView{payload},
            RowChecksum({commit->revision()}, payload))
      .Run();
}

}  // namespace dsg::sqlite
