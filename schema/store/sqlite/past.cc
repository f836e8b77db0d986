// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/past.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

constexpr char kSelectRevisions[] =
    "SELECT " DSG_REVISION_COLUMNS ", parent_digest FROM revision ORDER BY revision";
constexpr int kParentColumn = 18;

void AddTo(const RowSums& sums, Head* head) {
  RevisionInfo& info = head->info;
  head->content += sums.content;
  info.node_count += sums.node_count;
  info.edge_count += sums.edge_count;
  info.agent_count += sums.agent_count;
  info.pose_count += sums.pose_count;
  info.stay_count += sums.stay_count;
  info.mesh_block_count += sums.mesh_block_count;
  for (const auto& [layer, count] : sums.layer_counts) head->layer_counts[layer] += count;
}

}  // namespace

RowSums& RowSums::operator+=(const RowSums& other) {
  content += other.content;
  node_count += other.node_count;
  edge_count += other.edge_count;
  agent_count += other.agent_count;
  pose_count += other.pose_count;
  stay_count += other.stay_count;
  mesh_block_count += other.mesh_block_count;
  for (const auto& [layer, count] : other.layer_counts) layer_counts[layer] += count;
  return *this;
}

RowSums& RowSums::operator-=(const RowSums& other) {
  content -= other.content;
  node_count -= other.node_count;
  edge_count -= other.edge_count;
  agent_count -= other.agent_count;
  pose_count -= other.pose_count;
  stay_count -= other.stay_count;
  mesh_block_count -= other.mesh_block_count;
  for (const auto& [layer, count] : other.layer_counts) layer_counts[layer] -= count;
  return *this;
}

void PastChange::Take(const RowSums& row, Revision from, Revision to) {
  changes_[from] -= row;
  if (to != kRevisionMax) changes_[to] += row;
}

void PastChange::Put(const RowSums& row, Revision from, Revision to) {
  changes_[from] += row;
  if (to != kRevisionMax) changes_[to] -= row;
}

absl::Status PastChange::Apply(Database& db) const {
  DSG_RETURN_IF_ERROR(ApplySums(db));
  DSG_ASSIGN_OR_RETURN(const bool lists_changed, ApplyToLists(db));
  // Readers need not begin again when there was nothing to forget.
  if (changes_.empty() && !lists_changed) return absl::OkStatus();
  return Query(db, "UPDATE map SET generation = generation + 1").Run();
}

absl::Status PastChange::ApplySums(Database& db) const {
  if (changes_.empty()) return absl::OkStatus();
  auto change = changes_.begin();
  RowSums sums;
  Sha256 parent{};
  // As it stands there: a new digest over a record that is damaged would say that it is sound.
  Sha256 stored_parent{};
  Revision before = 0;
  std::vector<Head> changed;
  Query query(db, kSelectRevisions);
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(Head head, HeadFromRow(query, db.map_name()));
    const Revision revision = head.info.revision;
    if (revision != before + 1) {
      const std::string_view bytes = query.Blob(kParentColumn);
      if (bytes.size() != parent.size()) {
        return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
      }
      std::copy(bytes.begin(), bytes.end(), parent.begin());
      stored_parent = parent;
    }
    if (DigestOf(stored_parent, head) != head.info.digest) {
      return CorruptRow(db.map_name(), "revision", absl::StrCat(revision));
    }
    stored_parent = head.info.digest;
    before = revision;
    for (; change != changes_.end() && change->first <= revision; ++change) sums += change->second;
    if (revision >= changes_.begin()->first) {
      AddTo(sums, &head);
      head.info.digest = DigestOf(parent, head);
      changed.push_back(head);
    }
    parent = head.info.digest;
  }
  DSG_RETURN_IF_ERROR(query.status());
  query.Reset();
  for (const Head& head : changed) DSG_RETURN_IF_ERROR(UpdateRevision(db, head));
  return absl::OkStatus();
}

bool PastChange::Edit(Revision before, Revision revision, TouchedKeys* keys) const {
  bool is_changed = nodes_.Edit(before, revision, &keys->nodes);
  const size_t edge_count = keys->edges.size();
  std::erase_if(keys->edges, [&](const EdgeRowKey& key) {
    return !edges_.contains(key) && (nodes_.contains(key.source) || nodes_.contains(key.target));
  });
  is_changed = edges_.Edit(before, revision, &keys->edges) || is_changed;
  is_changed = mesh_blocks_.Edit(before, revision, &keys->mesh_blocks) || is_changed;
  const size_t track_count = keys->tracks.size();
  std::erase_if(keys->tracks, [&](NodeId agent) { return tracks_.contains(agent); });
  return is_changed || keys->edges.size() != edge_count || keys->tracks.size() != track_count;
}

absl::StatusOr<bool> PastChange::ApplyToLists(Database& db) const {
  std::vector<std::pair<Revision, std::string>> changed;
  {
    Query query(db,
                "SELECT revision.revision, payload, checksum FROM revision LEFT JOIN touched"
                " USING (revision) ORDER BY revision.revision");
    for (Revision before = 0; query.Next(); before = query.Int(0)) {
      const Revision revision = query.Int(0);
      // The first one of a compacted map has no list.
      if (query.IsNull(1)) continue;
      TouchedKeys keys;
      if (query.Int(2) != RowChecksum({revision}, query.Blob(1)) ||
          !DecodeTouched(query.Blob(1), &keys)) {
        return CorruptRow(db.map_name(), "touched", absl::StrCat(revision));
      }
      if (!Edit(before, revision, &keys)) continue;
      keys.Normalize();
      changed.emplace_back(revision, EncodeTouched(keys));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const auto& [revision, payload] : changed) {
    DSG_RETURN_IF_ERROR(
        Query(db, "UPDATE touched SET payload = ?2, checksum = ?3 WHERE revision = ?1")
            .Bind(revision, Query::BlobView{payload}, RowChecksum({revision}, payload))
            .Run());
  }
  return !changed.empty();
}

}  // namespace dsg::sqlite
