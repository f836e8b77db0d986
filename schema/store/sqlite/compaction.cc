// SPDX-License-Identifier: Apache-2.0
// First the revisions become unreadable, in one transaction; what is left of them then is garbage
// that nobody sees, and goes in small steps.
#include "schema/store/sqlite/compaction.h"

#include <algorithm>

#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/space.h"
#include "schema/store/touched_keys.h"

namespace dsg::sqlite {
namespace {

// Rows looked at in one transaction: some megabytes of log at most, tens of milliseconds.
struct HistoryTable {
  const char* last_row;
  const char* drop;
  int64_t step;
};

#define DSG_HISTORY_TABLE(name, step)                                           \
  {                                                                             \
    "SELECT max(rowid) FROM " name,                                             \
        "DELETE FROM " name                                                     \
        " AS old WHERE rowid > ?2 AND rowid <= ?3 AND rev_to <= ?1"             \
        " AND NOT EXISTS (SELECT 1 FROM tag WHERE tag.revision >= old.rev_from" \
        " AND tag.revision < old.rev_to)",                                      \
        step                                                                    \
  }

constexpr HistoryTable kHistories[] = {
    DSG_HISTORY_TABLE("node_history", 5'000),       DSG_HISTORY_TABLE("edge_history", 20'000),
    DSG_HISTORY_TABLE("trajectory_history", 1'000), DSG_HISTORY_TABLE("stay_history", 20'000),
    DSG_HISTORY_TABLE("mesh_block_history", 40),    DSG_HISTORY_TABLE("shape_history", 1'000),
    DSG_HISTORY_TABLE("factor_history", 1'000)};

#undef DSG_HISTORY_TABLE

// A mark matters to the readable revisions from it on, up to the next of its track.
constexpr char kDropMarks[] =
    "DELETE FROM track_mark AS old WHERE revision < ?1"
    " AND EXISTS (SELECT 1 FROM track_mark AS next WHERE next.slot = old.slot"
    "  AND next.revision > old.revision AND next.revision <= ?1)"
    " AND NOT EXISTS (SELECT 1 FROM tag WHERE tag.revision >= old.revision"
    "  AND tag.revision < (SELECT min(next.revision) FROM track_mark AS next"
    "   WHERE next.slot = old.slot AND next.revision > old.revision))";

// Records of revisions, oldest first: those that go leave their digest and their touched keys to
// the next one that stays.
class RevisionDropper {
 public:
  RevisionDropper(Database* db, const Readable& kept) : db_(*db), kept_(kept) {}

  absl::Status Run() {
    std::vector<std::pair<Revision, std::string>> revisions;
    Query query(db_,
                "SELECT revision, digest FROM revision WHERE revision <= ?1 ORDER BY revision");
    query.Bind(kept_.oldest);
    while (query.Next()) revisions.emplace_back(query.Int(0), query.Blob(1));
    DSG_RETURN_IF_ERROR(query.status());
    for (const auto& [revision, digest] : revisions) {
      DSG_RETURN_IF_ERROR(kept_.Holds(revision) ? Keep(revision) : Drop(revision, digest));
    }
    return absl::OkStatus();
  }

  int64_t count() const { return count_; }

 private:
  absl::Status TakeTouched(Revision revision) {
    Query query(db_, "SELECT revision, payload, checksum FROM touched WHERE revision = ?1");
    const bool found = query.Bind(revision).Next();
    DSG_RETURN_IF_ERROR(query.status());
    return found ? TouchedFromRow(query, db_.map_name(), &touched_) : absl::OkStatus();
  }

  absl::Status Drop(Revision revision, const std::string& digest) {
    digest_ = digest;
    ++count_;
    DSG_RETURN_IF_ERROR(TakeTouched(revision));
    for (const char* sql :
         {"DELETE FROM touched WHERE revision = ?1", "DELETE FROM revision WHERE revision = ?1"}) {
      DSG_RETURN_IF_ERROR(Query(db_, sql).Bind(revision).Run());
    }
    return absl::OkStatus();
  }

  absl::Status Keep(Revision revision) {
    if (!digest_.empty()) {
      DSG_RETURN_IF_ERROR(Query(db_, "UPDATE revision SET parent_digest = ?2 WHERE revision = ?1")
                              .Bind(revision, Query::BlobView{digest_})
                              .Run());
      DSG_RETURN_IF_ERROR(
          has_kept_ ? WriteTouchedSinceKept(revision)
                    : Query(db_, "DELETE FROM touched WHERE revision = ?1").Bind(revision).Run());
    }
    digest_.clear();
    touched_ = {};
    has_kept_ = true;
    return absl::OkStatus();
  }

  // Everything since the last revision that is kept.
  absl::Status WriteTouchedSinceKept(Revision revision) {
    DSG_RETURN_IF_ERROR(TakeTouched(revision));
    return UpdateTouched(db_, revision, &touched_);
  }

  Database& db_;
  const Readable& kept_;
  /// Of the last one dropped since one was kept; empty if none was.
  std::string digest_;
  TouchedKeys touched_;
  bool has_kept_ = false;
  int64_t count_ = 0;
};

// Nothing to close is found without a commit: a compaction may go on in many slices.
absl::StatusOr<bool> AreClosed(Database& db, Revision keep_from) {
  Query query(db,
              "SELECT oldest_revision = ?1 AND NOT EXISTS (SELECT 1 FROM revision"
              " WHERE revision < ?1 AND revision NOT IN (SELECT revision FROM tag)) FROM map");
  const bool found = query.Bind(keep_from).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found && query.Int(0) == 1;
}

absl::Status CloseRevisions(Database& db, Revision keep_from, CompactReport* report) {
  report->oldest = keep_from;
  DSG_ASSIGN_OR_RETURN(const bool are_closed, AreClosed(db, keep_from));
  if (are_closed) return absl::OkStatus();
  return InTransaction(db, [&]() -> absl::Status {
    DSG_RETURN_IF_ERROR(Query(db, "UPDATE map SET oldest_revision = ?1").Bind(keep_from).Run());
    DSG_ASSIGN_OR_RETURN(const Readable kept, LoadReadable(db));
    RevisionDropper dropper(&db, kept);
    DSG_RETURN_IF_ERROR(dropper.Run());
    report->revision_count += dropper.count();
    return absl::OkStatus();
  });
}

absl::Status DropRows(Database& db, const HistoryTable& table, const StopCheck& stop,
                      Compaction* work) {
  DSG_ASSIGN_OR_RETURN(const int64_t last, db.QueryInt(table.last_row));
  for (; work->after < last; work->after += table.step) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_RETURN_IF_ERROR(
        Query(db, table.drop).Bind(work->keep_from, work->after, work->after + table.step).Run());
    work->report.row_count += db.changed_row_count();
    CopyLogBack(db);
  }
  return absl::OkStatus();
}

// Those that nothing refers to any more; one of the newest revisions may be about to be referred
// to. They go on counting in the digests of the revisions that are kept.
absl::Status DropAssets(Database& db, const StopCheck& stop, Compaction* work) {
  DSG_ASSIGN_OR_RETURN(const std::vector<StoredAsset> stored, ListAssets(db));
  std::vector<StoredAsset> assets = stored;
  std::erase_if(assets,
                [&](const StoredAsset& asset) { return asset.rev_from >= work->keep_from; });
  if (assets.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::set<Sha256> used, ReadReferences(db, stored));
  for (const StoredAsset& asset : assets) {
    if (used.contains(asset.sha256)) continue;
    DSG_RETURN_IF_ERROR(InTransaction(db, [&] { return DropAsset(db, asset); }));
    ++work->report.asset_count;
    CopyLogBack(db);
    // After a step: finding out took the time of many.
    DSG_RETURN_IF_ERROR(AskStop(stop));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CompactMap(Database& db, const StopCheck& stop, const Progress& progress,
                        Compaction* work) {
  const auto tell = [&](double fraction) {
    if (progress) progress(fraction);
  };
  DSG_RETURN_IF_ERROR(CloseRevisions(db, work->keep_from, &work->report));
  for (; work->table < std::size(kHistories); ++work->table, work->after = 0) {
    tell(0.1 + 0.8 * static_cast<double>(work->table) / std::size(kHistories));
    DSG_RETURN_IF_ERROR(DropRows(db, kHistories[work->table], stop, work));
  }
  // Last: rows that are still there may need the marks to be understood.
  DSG_RETURN_IF_ERROR(Query(db, kDropMarks).Bind(work->keep_from).Run());
  work->report.row_count += db.changed_row_count();
  DSG_RETURN_IF_ERROR(DropAssets(db, stop, work));
  DSG_RETURN_IF_ERROR(GivePagesBack(db, stop));
  tell(0.95);
  work->report.is_shrunk = db.Checkpoint(/*truncate=*/true);
  tell(1.0);
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
