// SPDX-License-Identifier: Apache-2.0
// Which revisions can be read: all from the oldest one on, and older ones that have a tag.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/revision.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

struct Readable {
  Revision oldest = 0;
  /// Ascending, without repeats.
  std::vector<Revision> tagged;
  /// Changes when the past was rewritten.
  int64_t generation = 0;

  bool Holds(Revision revision) const;
  /// Whether rows of [from, to) are shown by a readable revision.
  bool HoldsAnyOf(Revision from, Revision to) const;
};

absl::StatusOr<Readable> LoadReadable(Database& db);

/// OUT_OF_RANGE/REVISION_IN_FUTURE, with what can be read instead.
absl::Status FutureError(const std::string& map, Revision revision, Revision newest,
                         const Readable& readable);

/// OUT_OF_RANGE/REVISION_COMPACTED, with what can be read instead.
absl::Status CompactedError(const std::string& map, Revision revision, Revision newest,
                            const Readable& readable);

/// Fails unless the revision can (still) be read. Within a read transaction: as all of it does.
/// Errors: OUT_OF_RANGE/REVISION_COMPACTED; ABORTED/MAP_REPLACED if the generation is another.
absl::Status CheckReadable(Database& db, Revision revision, int64_t generation);

}  // namespace dsg::sqlite
