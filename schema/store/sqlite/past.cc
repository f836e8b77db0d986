// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/past.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/revision_record.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

constexpr char kSelectRevisions[] =
    "SELECT " DSG_REVISION_COLUMNS ", parent_digest FROM revision ORDER BY revision";
constexpr int kParentColumn = 18;

}  // namespace

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
  std::vector<RevisionRecord> changed;
  Query query(db, kSelectRevisions);
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, db.map_name()));
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
      head.sums += sums;
      Seal(parent, &head);
      changed.push_back(head);
    }
    parent = head.info.digest;
  }
  DSG_RETURN_IF_ERROR(query.status());
  query.Reset();
  for (const RevisionRecord& head : changed) DSG_RETURN_IF_ERROR(UpdateRevision(db, head));
  return absl::OkStatus();
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
      if (!forgotten.Edit(before, revision, &keys)) continue;
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
