// SPDX-License-Identifier: Apache-2.0
// Whether a map still holds what a log has told it, or a revert has undone a part.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/commit/map_view.h"
#include "schema/store/graph_writer.h"
#include "schema/store/reverts.h"

namespace dsg::ingest {

/// Of the last deltas of a log that may grow on.
std::string EndSessionId(const std::string& session_id);

/// What was undone of all that a session and that of its end have committed at `from` and later.
/// Cost: a call, and one more for each thousand revisions since.
absl::StatusOr<std::optional<Undoing>> FindUndoing(const MapView& map,
                                                   const std::string& session_id, Revision from);

/// ABORTED, saying who has reverted `map` and how the log that is called `log` can go on.
absl::Status UndoneError(const std::string& log, const std::string& map, const Undoing& undoing);

struct OpenedSession {
  std::string session_id;
  SessionState state;
};

/// What to do where a revert has undone a part of a log.
struct UndoneOptions {
  /// Tell it again; else the log is refused.
  bool is_told_again = false;
  /// What is told again has other ids, so that nothing of the log may be left in the map.
  bool has_own_ids = false;
};

/// The session under which a log goes on: its own or, where that was undone and the log was told
/// again, the last one of those that followed; another one to tell it again.
/// Errors: UndoneError; ABORTED if a part of the log is left that must not be; of the map and the
/// writer.
absl::StatusOr<OpenedSession> OpenSession(const std::string& session_id, const std::string& log,
                                          const MapView& map, GraphWriter& writer,
                                          const UndoneOptions& options);

}  // namespace dsg::ingest
