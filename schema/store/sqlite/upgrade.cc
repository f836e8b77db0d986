// SPDX-License-Identifier: Apache-2.0
// A copy first, then one transaction: a map is of the old format or of the new one, never between.
#include "schema/store/sqlite/upgrade.h"

#include <filesystem>
#include <map>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/graph_rows.h"
#include "schema/store/sqlite/map_file.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/touched_keys.h"

namespace dsg::sqlite {

extern const char kLongLivedSql[];
extern const char kIdentitySql[];

namespace {

namespace fs = std::filesystem;

// Builds before the first release made maps without these lists.
constexpr char kMakeTouched[] =
    "CREATE TABLE IF NOT EXISTS touched (revision INTEGER PRIMARY KEY, payload BLOB NOT NULL,"
    " checksum INTEGER NOT NULL) STRICT";

// What each revision touched, from the rows that begin or end in it.
absl::Status FillTouched(Database& db) {
  std::map<Revision, TouchedKeys> touched;
  Query revisions(db, "SELECT revision FROM revision");
  while (revisions.Next()) touched[revisions.Int(0)];
  DSG_RETURN_IF_ERROR(revisions.status());
  Query rows(db, kTouchedRows);
  while (rows.Next()) {
    TouchedKeys& keys = touched[rows.Int(4)];
    switch (rows.Text(0).front()) {
      case 'N':
        keys.nodes.push_back(IdOf(rows.Int(1)));
        break;
      case 'E':
        keys.edges.push_back({IdOf(rows.Int(1)), rows.Int(2), IdOf(rows.Int(3))});
        break;
      case 'M':
        keys.mesh_blocks.push_back({static_cast<int32_t>(rows.Int(1)),
                                    static_cast<int32_t>(rows.Int(2)),
                                    static_cast<int32_t>(rows.Int(3))});
        break;
      case 'T':
        keys.tracks.push_back(IdOf(rows.Int(1)));
        break;
      default:
        keys.layers_or_labels = true;
    }
  }
  DSG_RETURN_IF_ERROR(rows.status());
  for (auto& [revision, keys] : touched) DSG_RETURN_IF_ERROR(InsertTouched(db, revision, &keys));
  return absl::OkStatus();
}

absl::Status FillNodeCells(Database& db) {
  Query query(db, "SELECT key, rev_from, layer, payload, checksum FROM node");
  while (query.Next()) {
    DSG_ASSIGN_OR_RETURN(const Node node, NodeFromRow(query, db.map_name()));
    DSG_RETURN_IF_ERROR(AddCell(db, node));
  }
  return query.status();
}

absl::Status FromFormat1(Database& db) {
  DSG_ASSIGN_OR_RETURN(
      const int64_t has_lists,
      db.QueryInt("SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = 'touched'"));
  if (has_lists == 0) {
    DSG_RETURN_IF_ERROR(db.Execute(kMakeTouched));
    DSG_RETURN_IF_ERROR(FillTouched(db));
  }
  DSG_RETURN_IF_ERROR(db.Execute(kLongLivedSql));
  return FillNodeCells(db);
}

absl::Status UpgradeFrom(int64_t format, Database& db) {
  if (format < 2) DSG_RETURN_IF_ERROR(FromFormat1(db));
  DSG_RETURN_IF_ERROR(db.Execute(kIdentitySql));
  DSG_RETURN_IF_ERROR(Query(db, "UPDATE map SET incarnation = ?1").Bind(NewIncarnation()).Run());
  return db.Execute(absl::StrCat("PRAGMA user_version=", kStoreFormatVersion).c_str());
}

// The whole map is in the file once its log has been copied back and nobody else writes.
absl::StatusOr<std::string> KeepCopy(Database& db, int64_t format) {
  if (!db.Checkpoint(/*truncate=*/true)) {
    return MakeError(Reason::kWriterLocked,
                     absl::StrCat("map \"", db.map_name(),
                                  "\" is being read, so that its log cannot be copied back; stop "
                                  "the readers and try again"),
                     {{"map", db.map_name()}});
  }
  const std::string copy = absl::StrCat(db.path(), ".format", format);
  const std::string partial = copy + ".new";
  std::error_code error;
  // What a killed upgrade left; of a link the link, so that nothing is written where it points.
  fs::remove(partial, error);
  fs::copy_file(db.path(), partial, fs::copy_options::none, error);
  if (!error) DSG_RETURN_IF_ERROR(SyncFile(partial));
  if (!error) fs::rename(partial, copy, error);
  if (error) {
    fs::remove(partial, error);
    return MakeError(Reason::kDiskFull,
                     absl::StrCat("cannot keep a copy of map \"", db.map_name(), "\" as ", copy,
                                  ", so nothing was changed; free some space and try again"),
                     {{"map", db.map_name()}});
  }
  return copy;
}

}  // namespace

absl::StatusOr<UpgradeReport> UpgradeMapFile(const std::string& store_folder,
                                             const std::string& map, const std::string& program) {
  DSG_RETURN_IF_ERROR(CheckMapName(map));
  DSG_ASSIGN_OR_RETURN(auto db, OpenAnyFormat(store_folder, map, Database::Mode::kRead));
  DSG_ASSIGN_OR_RETURN(const auto lock, WriterLock::Acquire(store_folder, map, program));
  DSG_ASSIGN_OR_RETURN(db, OpenAnyFormat(store_folder, map, Database::Mode::kWrite));
  UpgradeReport report;
  DSG_ASSIGN_OR_RETURN(report.from_format, db->QueryInt("PRAGMA user_version"));
  report.to_format = kStoreFormatVersion;
  if (report.from_format == kStoreFormatVersion) return report;
  DSG_ASSIGN_OR_RETURN(report.copy, KeepCopy(*db, report.from_format));
  DSG_RETURN_IF_ERROR(db->Execute("BEGIN IMMEDIATE"));
  absl::Status status = UpgradeFrom(report.from_format, *db);
  if (status.ok()) status = db->Execute("COMMIT");
  if (!status.ok()) db->Execute("ROLLBACK").IgnoreError();
  DSG_RETURN_IF_ERROR(status);
  return report;
}

}  // namespace dsg::sqlite
