// SPDX-License-Identifier: Apache-2.0
// Which revisions can be read, as the tables of the map say.
#pragma once

#include "absl/status/statusor.h"
#include "schema/store/readable.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

absl::StatusOr<Readable> LoadReadable(Database& db);

/// Fails unless the revision can (still) be read. Within a read transaction: as all of it does.
/// Errors: OUT_OF_RANGE/REVISION_COMPACTED; ABORTED/MAP_REPLACED if the generation is another.
absl::Status CheckStillReadable(Database& db, Revision revision, int64_t generation);

}  // namespace dsg::sqlite
