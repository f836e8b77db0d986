// SPDX-License-Identifier: Apache-2.0
// How far each session got, so that a delta that comes twice is written once.
#pragma once

#include <optional>
#include <string>

#include "schema/model/revision.h"
#include "schema/store/commit_protocol.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// All zero for a session that has committed nothing.
absl::StatusOr<SessionState> ReadSession(Database& db, const std::string& session_id);

/// The session is at this revision now.
absl::Status WriteSession(Database& db, const RevisionInfo& info, int64_t delta_checksum);

/// nullopt if the delta is new.
absl::StatusOr<std::optional<CommittedDelta>> FindCommitted(Database& db,
                                                            const std::string& session_id,
                                                            int64_t sequence);

/// What was erased must not be told from its checksum.
absl::Status ForgetDeltaChecksums(Database& db);

}  // namespace dsg::sqlite
