// SPDX-License-Identifier: Apache-2.0
// How far each session got, so that a delta that comes twice is written once.
#pragma once

#include <optional>
#include <string>

#include "schema/model/revision.h"
#include "schema/store/graph_writer.h"
#include "schema/store/sqlite/database.h"

namespace dsg::sqlite {

/// All zero for a session that has committed nothing.
absl::StatusOr<SessionState> ReadSession(Database& db, const std::string& session_id);

/// What a delta is known by. `checksum` is its DeltaChecksum.
struct DeltaIdentity {
  const std::string& session_id;
  int64_t sequence = 0;
  int64_t checksum = 0;
};

/// The session is at this revision now.
absl::Status WriteSession(Database& db, const RevisionInfo& info, int64_t delta_checksum);

/// A revision that holds the delta: the one that it made or, if that is compacted away, the last
/// one of its session; nullopt if the delta is new.
/// Errors: ALREADY_EXISTS/SEQUENCE_REUSED when another delta was committed under the name. What an
/// erasure or an older format left without a checksum is believed, and so is a delta whose
/// revision is compacted away, unless it was the last of its session.
absl::StatusOr<std::optional<CommitResult>> FindCommitted(Database& db, const DeltaIdentity& delta);

/// What was erased must not be told from its checksum.
absl::Status ForgetDeltaChecksums(Database& db);

}  // namespace dsg::sqlite
