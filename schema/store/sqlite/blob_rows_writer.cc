// SPDX-License-Identifier: Apache-2.0
// Stays, mesh blocks and assets.
#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {
namespace {

constexpr size_t kAssetPartBytes = size_t{1} << 20;

absl::Status EndStay(int64_t agent, int64_t enter_ns, Query& current, CommitContext* commit) {
  const int64_t exit_ns = current.Int(0);
  const int64_t place = current.Int(1);
  const int64_t room = current.Int(2);
  const int64_t rev_from = current.Int(3);
  const std::initializer_list<int64_t> columns = {agent, enter_ns, exit_ns, place, room, rev_from};
  if (current.Int(4) != RowChecksum32(columns, "")) {
    return CorruptRow(commit->spec.name, "stay",
                      absl::StrCat(ToString(IdOf(agent)), " ", enter_ns));
  }
  commit->head.content.Remove(RowIdentity('S', columns, ""));
  --commit->head.info.stay_count;
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
  const int64_t place = KeyOf(stay.place);
  const int64_t room = KeyOf(stay.room);
  {
    Query current(commit->db,
                  "SELECT exit_ns, place, room, rev_from, checksum FROM stay"
                  " WHERE agent = ?1 AND enter_ns = ?2");
    const bool exists = current.Bind(agent, stay.enter_ns).Next();
    DSG_RETURN_IF_ERROR(current.status());
    if (exists) {
      if (current.Int(0) == stay.exit_ns && current.Int(1) == place && current.Int(2) == room) {
        return absl::OkStatus();
      }
      DSG_RETURN_IF_ERROR(EndStay(agent, stay.enter_ns, current, commit));
    }
  }
  const std::initializer_list<int64_t> columns = {agent, stay.enter_ns, stay.exit_ns,
                                                  place, room,          commit->revision()};
  commit->head.content.Add(RowIdentity('S', columns, ""));
  ++commit->head.info.stay_count;
  return Query(commit->db,
               "INSERT INTO stay (agent, enter_ns, exit_ns, place, room, rev_from, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
      .Bind(agent, stay.enter_ns, stay.exit_ns, place, room, commit->revision(),
            RowChecksum32(columns, ""))
      .Run();
}

absl::StatusOr<bool> EndMeshBlock(const BlockIndex& index, CommitContext* commit) {
  Query current(
      commit->db,
      "SELECT rev_from, payload, checksum FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3");
  const bool exists = current.Bind(index.x, index.y, index.z).Next();
  DSG_RETURN_IF_ERROR(current.status());
  if (!exists) return false;
  const std::initializer_list<int64_t> columns = {index.x, index.y, index.z, current.Int(0)};
  if (current.Int(2) != RowChecksum(columns, current.Blob(1))) {
    return CorruptRow(commit->spec.name, "mesh_block",
                      absl::StrCat(index.x, ",", index.y, ",", index.z));
  }
  commit->touched.mesh_blocks.push_back(index);
  commit->head.content.Remove(RowIdentity('M', columns, current.Blob(1)));
  --commit->head.info.mesh_block_count;
  DSG_RETURN_IF_ERROR(
      Query(commit->db,
            "INSERT INTO mesh_block_history (x, y, z, rev_from, rev_to, checksum, payload)"
            " SELECT x, y, z, rev_from, ?4, checksum, payload FROM mesh_block"
            " WHERE x = ?1 AND y = ?2 AND z = ?3")
          .Bind(index.x, index.y, index.z, commit->revision())
          .Run());
  DSG_RETURN_IF_ERROR(Query(commit->db, "DELETE FROM mesh_block WHERE x = ?1 AND y = ?2 AND z = ?3")
                          .Bind(index.x, index.y, index.z)
                          .Run());
  return true;
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
  DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit).status());
  const std::initializer_list<int64_t> columns = {index.x, index.y, index.z, commit->revision()};
  commit->touched.mesh_blocks.push_back(index);
  commit->head.content.Add(RowIdentity('M', columns, payload));
  ++commit->head.info.mesh_block_count;
  return Query(commit->db,
               "INSERT INTO mesh_block (x, y, z, rev_from, checksum, payload)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6)")
      .Bind(index.x, index.y, index.z, commit->revision(), RowChecksum(columns, payload),
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
    Query current(commit->db,
                  "SELECT exit_ns, place, room, rev_from, checksum FROM stay"
                  " WHERE agent = ?1 AND enter_ns = ?2");
    if (current.Bind(KeyOf(key.agent), key.enter_ns).Next()) {
      DSG_RETURN_IF_ERROR(EndStay(KeyOf(key.agent), key.enter_ns, current, commit));
    }
    DSG_RETURN_IF_ERROR(current.status());
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

absl::Status WriteMesh(const GraphDelta& delta, CommitContext* commit) {
  for (const BlockIndex& index : delta.mesh_removals) {
    DSG_RETURN_IF_ERROR(EndMeshBlock(index, commit).status());
  }
  for (const MeshBlock& block : delta.mesh_blocks) {
    DSG_RETURN_IF_ERROR(WriteMeshBlock(block, commit));
  }
  return absl::OkStatus();
}

absl::Status WriteAssets(const std::vector<Asset>& assets, CommitContext* commit) {
  for (const Asset& asset : assets) {
    const std::string_view sha256(reinterpret_cast<const char*>(asset.sha256.data()),
                                  asset.sha256.size());
    Query known(commit->db, "SELECT 1 FROM asset WHERE sha256 = ?1 AND part = 0");
    if (known.Bind(Query::BlobView{sha256}).Next()) continue;
    DSG_RETURN_IF_ERROR(known.status());
    commit->head.content.Add(RowIdentity('A', {commit->revision()}, sha256));
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
