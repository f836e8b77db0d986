// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/readable_rows.h"

namespace dsg::sqlite {

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
