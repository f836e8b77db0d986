// SPDX-License-Identifier: Apache-2.0
// Which revisions can be read: all from the oldest one on, and older ones that have a tag.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "schema/model/ids.h"

namespace dsg {

struct Readable {
  Revision oldest = 0;
  /// Ascending, without repeats.
  std::vector<Revision> tagged;
  /// Changes when the past was rewritten.
  int64_t generation = 0;

  bool Holds(Revision revision) const;
  /// Whether a readable revision shows rows of [from, to). Compaction drops the others.
  bool HoldsAnyOf(Revision from, Revision to) const;
};

/// Fails unless the revision can be read, saying what can be read instead.
/// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE or REVISION_COMPACTED, both with oldest and newest.
absl::Status CheckReadable(const std::string& map, Revision revision, Revision newest,
                           const Readable& readable);

/// ABORTED/MAP_REPLACED: readers of the map find that its past was rewritten under them.
absl::Status RewrittenError(const std::string& map);

}  // namespace dsg
