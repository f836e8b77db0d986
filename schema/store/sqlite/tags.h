// SPDX-License-Identifier: Apache-2.0
// Names for revisions.
#pragma once

#include <string>
#include <vector>

#include "schema/store/map_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Order: by name.
absl::StatusOr<std::vector<Tag>> ReadTags(Database& db);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID. The revision is not looked at.
absl::Status CheckTag(const Tag& tag);

/// Errors: RESOURCE_EXHAUSTED/QUOTA_EXCEEDED at 10,000 tags, or 2 MiB of notes, a map.
absl::Status WriteTag(Database& db, const Tag& tag);

/// Errors: NOT_FOUND/TAG_UNKNOWN.
absl::Status DeleteTag(Database& db, const std::string& name);

}  // namespace dsg::sqlite
