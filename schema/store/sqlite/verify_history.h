// SPDX-License-Identifier: Apache-2.0
// Whether the records of revisions are what their rows add up to, and none is missing.
// Refuses to look into rows: who has read them says what they add.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "schema/codec/checksum.h"
#include "schema/model/revision.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// Compares the digest of each revision, and the list of what it touched, with what the rows say.
/// `changes` is what the rows add to and take from the content at each revision. Returns the
/// number of revisions.
int64_t CheckRevisions(Database& db, const std::string& map,
                       std::map<Revision, ContentDigest> changes,
                       const std::function<void(std::string)>& problem);

}  // namespace dsg::sqlite
