// SPDX-License-Identifier: Apache-2.0
// The records of past revisions, made right again after rows of the past were taken out: sums,
// digests, lists of what was touched.
#pragma once

#include <map>

#include "schema/store/content_rows.h"
#include "schema/store/erase_list.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// How the past of a map differs from what its records say.
class PastChange {
 public:
  /// A row that was shown from revision `from` on, until before `to`.
  void Take(const RowSums& row, Revision from, Revision to);
  void Put(const RowSums& row, Revision from, Revision to);

  /// Keys whose rows of the past are gone.
  ForgottenKeys forgotten;

  /// Writes the records anew. Within a transaction.
  absl::Status Apply(Database& db) const;

 private:
  absl::Status ApplySums(Database& db) const;
  absl::StatusOr<bool> ApplyToLists(Database& db) const;

  std::map<Revision, RowSums> changes_;
};

}  // namespace dsg::sqlite
