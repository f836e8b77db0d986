// SPDX-License-Identifier: Apache-2.0
// Space on the disk: what deleted rows leave is overwritten and given back to the file system, and
// a reserve is kept for work that frees space. Refuses to change what any question is answered
// with.
#pragma once

#include <cstdint>
#include <string>

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

/// A file that does nothing but take space: given up when the disk is full, so that what frees
/// space has some to work with. Refuses to take space that is scarce.
///
/// Threads: one at a time, of the process that writes the map.
class Reserve {
 public:
  /// `folder`: of the map; `bytes`: 0 = none.
  Reserve(const std::string& folder, int64_t bytes)
      : folder_(folder), path_(folder + "/reserve"), bytes_(bytes) {}

  /// Makes the file, unless it is there or the disk has less than four times its size left.
  void Make() const;
  bool IsThere() const;
  /// Removes it; false if there was none.
  bool Release() const;

 private:
  std::string folder_;
  std::string path_;
  int64_t bytes_;
};

}  // namespace dsg::sqlite
