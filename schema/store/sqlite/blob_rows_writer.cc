// SPDX-License-Identifier: Apache-2.0
// Stays, mesh blocks and assets.
#include "schema/codec/proto_convert.h"
#include "schema/store/snapshot.h"
#include "schema/store/sqlite/commit.h"
#include "schema/store/sqlite/graph_rows.h"

namespace dsg::sqlite {
namespace {

constexpr char kSelectStay[] =
    "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum FROM stay"
    " WHERE agent = ?1 AND enter_ns = ?2";

absl::Status EndStay(const StayRow& row, CommitContext* commit) {
  const int64_t agent = KeyOf(row.agent);
  const TimeNs enter_ns = row.enter_ns;
  commit->head.sums.Remove(row);
  DSG_RETURN_IF_ERROR(
      Query(commit->db,
            "INSERT INTO stay_history"
            " (agent, enter_ns, exit_ns, place, room, rev_from, rev_to, checksum)"
            " SELECT agent, enter_ns, exit_ns, place, room, rev_from, ?3, checksum FROM stay"
            " WHERE agent = ?1 AND enter_ns = ?2")
          .Bind(agent, enter_ns, commit->revision())
          .Run());
  return Query(commit->db, "DELETE FROM stay WHERE agent = ?1 AND enter_ns = ?2")
      .Bind(agent, enter_ns)
      .Run();
}

absl::Status WriteStay(const Stay& stay, CommitContext* commit) {
  const int64_t agent = KeyOf(stay.agent);
  {
    Query current(commit->db, kSelectStay);
    const bool exists = current.Bind(agent, stay.enter_ns).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (exists) {
      DSG_ASSIGN_OR_RETURN(const StayRow known, StayRowOf(current, commit->spec.name));
      if (known.stay() == stay) return absl::OkStatus();
      DSG_RETURN_IF_ERROR(EndStay(known, commit));
    }
  }
  const StayRow row{stay.agent, stay.enter_ns, stay.exit_ns,
                    stay.place, stay.room,     commit->revision()};
  commit->head.sums.Add(row);
  return Query(commit->db,
               "INSERT INTO stay (agent, enter_ns, exit_ns, place, room, rev_from, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
      .Bind(agent, stay.enter_ns, stay.exit_ns, KeyOf(stay.place), KeyOf(stay.room),
            commit->revision(), ChecksumOf(row))
      .Run();
}

absl::Status EndMeshBlock(const BlockIndex& index, CommitContext* commit) {
  Query current(commit->db,
                "SELECT x, y, z, rev_from, payload, checksum FROM mesh_block"
                " WHERE x = ?1 AND y = ?2 AND z = ?3");
  const bool exists = current.Bind(index.x, index.y, index.z).Next();
  DSG_RETURN_IF_ERROR(current.status());
  if (!exists) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const MeshRow row, MeshRowOf(current, commit->spec.name));
  commit->touched.mesh_blocks.push_back(index);
  commit->head.sums.Remove(row);
  DSG_RETURN_IF_ERROR(
      Query(commit->db,
            "INSERT INTO mesh_block_history (x, y, z, rev_from, rev_to, checksum, payload)"
            " SELECT x, y, z, rev_from, ?4, checksum, payload FROM mesh_block"
            " WHERE x = ?1 AND y = ?2 AND z = ?3")
          .Bind(index.x, index.y, index.z, commit->revision())
          .Run());
  return Query(commit->db, "DELETE FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3")
      .Bind(index.x, index.y, index.z)
      .Run();
}

absl::Status WriteMeshBlock(const MeshBlock& block, CommitContext* commit) {
  const BlockIndex& index = block.index;
  const std::string payload = EncodeMeshBlock(block);
  {
    Query current(commit->db, "SELECT payload FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3");
    if (current.Bind(index.x, index.y, index.z).Next() && current.Blob(0) == payload) {
      return absl::OkStatus();
    }
    DSG_RETURN_IF_ERROR(current.status());
  }
  DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit));
  const MeshRow row{index, commit->revision(), payload};
  commit->touched.mesh_blocks.push_back(index);
  commit->head.sums.Add(row);
  return Query(commit->db,
               "INSERT INTO mesh_block (x, y, z, rev_from, checksum, payload)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
      .Bind(index.x, index.y, index.z, commit->revision(), ChecksumOf(row),
            Query::BlobView{payload})
      .Run();
}

}  // namespace

absl::Status WriteStays(const std::vector<Stay>& stays, CommitContext* commit) {
  for (const Stay& stay : stays) DSG_RETURN_IF_ERROR(WriteStay(stay, commit));
  return absl::OkStatus();
}

absl::Status EndStays(const std::vector<StayKey>& keys, CommitContext* commit) {
  for (const StayKey& key : keys) {
    Query current(commit->db, kSelectStay);
    const bool exists = current.Bind(KeyOf(key.agent), key.enter_ns).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (!exists) continue;
    DSG_ASSIGN_OR_RETURN(const StayRow row, StayRowOf(current, commit->spec.name));
    DSG_RETURN_IF_ERROR(EndStay(row, commit));
  }
  return absl::OkStatus();
}

absl::Status EndStaysOf(NodeId agent, CommitContext* commit) {
  std::vector<StayKey> keys;
  {
    Query query(commit->db, "SELECT enter_ns FROM stay WHERE agent = ?1");
    query.Bind(KeyOf(agent));
    while (query.Next()) keys.push_back({agent, query.Int(0)});
    DSG_RETURN_IF_ERROR(query.status());
  }
  return EndStays(keys, commit);
}

absl::Status EndMeshBlocks(const std::vector<BlockIndex>& indices, CommitContext* commit) {
  for (const BlockIndex& index : indices) DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit));
  return absl::OkStatus();
}

absl::Status WriteMeshBlocks(const std::vector<MeshBlock>& blocks, CommitContext* commit) {
  for (const MeshBlock& block : blocks) DSG_RETURN_IF_ERROR(WriteMeshBlock(block, commit));
  return absl::OkStatus();
}

absl::Status WriteAssets(const std::vector<Asset>& assets, CommitContext* commit) {
  for (const Asset& asset : assets) {
    const std::string_view sha256 = BytesOf(asset.sha256);
    Query known(commit->db, "SELECT 1 FROM asset WHERE sha256 = ?1 AND part = 0");
    if (known.Bind(Query::BlobView{sha256}).Next()) continue;
    DSG_RETURN_IF_ERROR(known.status());
    commit->head.sums.Add(AssetRow{commit->revision(), sha256});
    const std::string_view content = asset.content;
    // An empty asset still needs its one row.
    for (size_t part = 0; part == 0 || part * kAssetPartBytes < content.size(); ++part) {
      const std::string_view bytes = content.substr(part * kAssetPartBytes, kAssetPartBytes);
      DSG_RETURN_IF_ERROR(
          Query(commit->db,
                "INSERT INTO asset (sha256, part, rev_from, media_type, checksum, payload)"
                " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
              .Bind(Query::BlobView{sha256}, static_cast<int64_t>(part), commit->revision(),
                    asset.media_type, Checksum(bytes, part), Query::BlobView{bytes})
              .Run());
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
