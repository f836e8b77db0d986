// SPDX-License-Identifier: Apache-2.0
// The only way into a map. Local (holding the map's writer lock) or remote, callers need not know.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"

namespace dsg {

struct CommitResult {
  Revision revision = 0;
  /// True when the same (session_id, sequence) had been committed before.
  bool replayed = false;
};

struct SessionState {
  /// 0 = the session has committed nothing.
  int64_t last_sequence = 0;
  Revision last_revision = 0;
  /// Of its first delta: what the map held before is older.
  Revision first_revision = 0;
};

/// Threads: one caller at a time.
class GraphWriter {
 public:
  virtual ~GraphWriter() = default;

  /// Applies the delta in one transaction and returns when it survives a power cut.
  ///
  /// The same delta again, by session, sequence and content, is answered as the first time.
  ///
  /// Errors: what CheckDelta returns; ABORTED/PARENT_REVISION_STALE; ABORTED/SEQUENCE_GAP;
  /// ALREADY_EXISTS/SEQUENCE_REUSED when another delta was committed under its session and
  /// sequence; RESOURCE_EXHAUSTED/DISK_FULL, nothing written; UNAVAILABLE/COMMIT_OUTCOME_UNKNOWN
  /// when the disk failed in the very commit: ask again with the same session and sequence.
  virtual absl::StatusOr<CommitResult> Commit(GraphDelta delta) = 0;

  /// How far a session got, so that an interrupted log can be resumed.
  virtual absl::StatusOr<SessionState> GetSession(const std::string& session_id) = 0;
};

}  // namespace dsg
