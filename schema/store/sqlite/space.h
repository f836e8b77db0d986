// SPDX-License-Identifier: Apache-2.0
// Space that deleted rows leave: given back to the file system, and what it held overwritten.
// Refuses to change what any question is answered with.
#pragma once

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Runs `work` in a transaction: all or nothing.
template <typename Work>
absl::Status InTransaction(Database& db, const Work& work) {
  DSG_RETURN_IF_ERROR(db.Execute("BEGIN IMMEDIATE"));
  absl::Status status = work();
  if (status.ok()) status = db.Execute("COMMIT");
  // SQLite may have rolled back already; then this has nothing to do.
  if (!status.ok()) db.Execute("ROLLBACK").IgnoreError();
  return status;
}

/// Copies the write-ahead log back once it is large.
void CopyLogBack(Database& db);

/// Cuts free pages off the end of the file, in steps. Files that came from format 1 are written
/// anew, once.
absl::Status GivePagesBack(Database& db, const StopCheck& stop);

/// Overwrites what deleted entries left in the nodes of the R*Trees.
absl::Status WipeBoxes(Database& db, const StopCheck& stop);

}  // namespace dsg::sqlite
