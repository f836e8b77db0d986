// SPDX-License-Identifier: Apache-2.0
// The table of tags.
#pragma once

#include <string>
#include <vector>

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Order: by name.
absl::StatusOr<std::vector<Tag>> ReadTags(Database& db);

/// Errors: as CheckTagBounds.
absl::Status WriteTag(Database& db, const Tag& tag);

/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::Status DeleteTag(Database& db, const std::string& name);

}  // namespace dsg::sqlite
