// SPDX-License-Identifier: Apache-2.0
// The revision table: one row a commit, each sealed by a digest over the one before.
#include <charconv>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/sessions.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

std::string FormatCounts(const std::map<LayerId, int64_t>& counts) {
  std::string text;
  for (const auto& [layer, count] : counts) {
    if (count == 0) continue;
    absl::StrAppend(&text, text.empty() ? "" : " ", layer, ":", count);
  }
  return text;
}

bool ParseCounts(std::string_view text, std::map<LayerId, int64_t>* counts) {
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    LayerId layer = 0;
    int64_t count = 0;
    const auto colon = std::from_chars(at, end, layer);
    if (colon.ec != std::errc() || colon.ptr == end || *colon.ptr != ':') return false;
    const auto stop = std::from_chars(colon.ptr + 1, end, count);
    if (stop.ec != std::errc()) return false;
    (*counts)[layer] = count;
    at = stop.ptr < end ? stop.ptr + 1 : end;
  }
  return true;
}

std::string_view View(const Sha256& digest) {
  return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

constexpr char kSelectNewest[] =
    "SELECT " DSG_REVISION_COLUMNS " FROM revision ORDER BY revision DESC LIMIT 1";

}  // namespace

// The wall clock is left out, so that the same deltas give the same digests everywhere.
Sha256 DigestOf(const Sha256& parent, const Head& head) {
  const RevisionInfo& info = head.info;
  std::string record(View(parent));
  absl::StrAppend(&record, info.revision, "\n", info.session_id, "\n", info.sequence, "\n",
                  info.author, "\n", info.message, "\n", info.config_digest, "\n");
  absl::StrAppend(&record, info.node_count, " ", info.edge_count, " ", info.agent_count, " ",
                  info.pose_count, " ", info.stay_count, " ", info.mesh_block_count, "\n",
                  FormatCounts(head.layer_counts), "\n");
  record += head.content.bytes();
  return ComputeSha256(record);
}

absl::StatusOr<Head> HeadFromRow(const Query& query, const std::string& map) {
  Head head;
  RevisionInfo& info = head.info;
  info.revision = query.Int(0);
  const std::string_view digest = query.Blob(1);
  const std::string_view content = query.Blob(2);
  if (digest.size() != info.digest.size() || content.size() != 16 ||
      !ParseCounts(query.Text(17), &head.layer_counts)) {
    return CorruptRow(map, "revision", absl::StrCat(info.revision));
  }
  std::copy(digest.begin(), digest.end(), info.digest.begin());
  head.content = ContentDigest::FromBytes(content);
  info.committed_ns = query.Int(3);
  info.author = query.Text(4);
  info.message = query.Text(5);
  info.session_id = query.Text(6);
  info.sequence = query.Int(7);
  info.config_digest = query.Text(8);
  info.node_count = query.Int(9);
  info.edge_count = query.Int(10);
  info.agent_count = query.Int(11);
  info.pose_count = query.Int(12);
  info.stay_count = query.Int(13);
  info.mesh_block_count = query.Int(14);
  if (!query.IsNull(15)) head.first_pose_ns = query.Int(15);
  if (!query.IsNull(16)) head.last_pose_ns = query.Int(16);
  return head;
}

absl::StatusOr<Head> LoadHead(Database& db) {
  Query query(db, kSelectNewest);
  const bool found = query.Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return Head();
  return HeadFromRow(query, db.map_name());
}

absl::Status InsertRevision(const CommitContext& commit) {
  const RevisionInfo& info = commit.head.info;
  DSG_RETURN_IF_ERROR(WriteSession(commit.db, info, commit.delta_checksum));
  const std::string content = commit.head.content.bytes();
  return Query(commit.db,
               "INSERT INTO revision (" DSG_REVISION_COLUMNS
               ", delta_checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13,"
               " ?14, ?15, ?16, ?17, ?18, ?19)")
      .Bind(info.revision, Query::BlobView{View(info.digest)}, Query::BlobView{content},
            info.committed_ns, info.author, info.message, info.session_id, info.sequence,
            info.config_digest, info.node_count, info.edge_count, info.agent_count, info.pose_count,
            info.stay_count, info.mesh_block_count, commit.head.first_pose_ns,
            commit.head.last_pose_ns, FormatCounts(commit.head.layer_counts), commit.delta_checksum)
      .Run();
}

absl::Status UpdateRevision(Database& db, const Head& head) {
  const RevisionInfo& info = head.info;
  const std::string content = head.content.bytes();
  return Query(db,
               "UPDATE revision SET digest = ?2, content = ?3, node_count = ?4, edge_count = ?5,"
               " agent_count = ?6, pose_count = ?7, stay_count = ?8, mesh_block_count = ?9,"
               " first_pose_ns = ?10, last_pose_ns = ?11, layer_counts = ?12 WHERE revision = ?1")
      .Bind(info.revision, Query::BlobView{View(info.digest)}, Query::BlobView{content},
            info.node_count, info.edge_count, info.agent_count, info.pose_count, info.stay_count,
            info.mesh_block_count, head.first_pose_ns, head.last_pose_ns,
            FormatCounts(head.layer_counts))
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
