// SPDX-License-Identifier: Apache-2.0
// Rules for the names of revisions: what a tag may be, how many a map may have, and what errors
// say.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "schema/store/map_writer.h"

namespace dsg {

/// "autumn, spring and 3 more"; "none". Does not list thousands: nobody reads them.
std::string TagNames(const std::vector<Tag>& tags);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID. The revision is not looked at.
absl::Status CheckTag(const Tag& tag);

/// Whether a map that has `count` other tags, with notes of `note_bytes` bytes in all, may have
/// this one too.
/// Errors: RESOURCE_EXHAUSTED/QUOTA_EXCEEDED at 10,000 tags, or 2 MiB of notes, a map.
absl::Status CheckTagBounds(const std::string& map, const Tag& tag, int64_t count,
                            int64_t note_bytes);

/// NOT_FOUND/TAG_UNKNOWN naming those there are.
absl::Status UnknownTag(const std::string& map, const std::string& name,
                        const std::vector<Tag>& tags);

}  // namespace dsg
