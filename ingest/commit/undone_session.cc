// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/undone_session.h"

#include <iterator>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Mostly nobody has committed since; where somebody has, it may be a year of revisions.
constexpr int kRevisionsFirst = 4;
constexpr int kRevisionsPerCall = 1000;

absl::Status PartIsLeft(const std::string& log, const std::string& map, Revision first) {
  return absl::AbortedError(absl::StrCat(
      log, ": a part of this log is left in map \"", map,
      "\", and would stand there twice, since its things get other ids when they are told again: "
      "go back with \"dsg revert ",
      first - 1, "\" to what the map held before the log, then run the same again"));
}

}  // namespace

std::string EndSessionId(const std::string& session_id) { return session_id + "-end"; }

absl::StatusOr<std::optional<Undoing>> FindUndoing(const MapView& map,
                                                   const std::string& session_id, Revision from) {
  UndoingSearch search([own = session_id, end = EndSessionId(session_id)](const std::string& id) {
    return id == own || id == end;
  });
  Revision before = 0;
  for (int limit = kRevisionsFirst;; limit = kRevisionsPerCall) {
    DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> revisions,
                         map.ListRevisions(before, limit));
    for (const RevisionInfo& info : revisions) {
      if (info.revision >= from) search.Take(info);
    }
    if (std::ssize(revisions) < limit || revisions.back().revision <= from) break;
    before = revisions.back().revision;
  }
  return search.found();
}

absl::Status UndoneError(const std::string& log, const std::string& map, const Undoing& undoing) {
  const std::string back = undoing.has_later
                               ? absl::StrCat("undo with \"dsg revert ", undoing.revert.revision,
                                              "\" what it has told since, and ")
                               : absl::StrCat("bring it back with \"dsg revert ", undoing.before,
                                              "\" and run the same again, or ");
  return absl::AbortedError(
      absl::StrCat(log, ": map \"", map, "\" was reverted to revision ", undoing.to, " by \"",
                   undoing.revert.author, "\" (revision ", undoing.revert.revision,
                   "), and what this log had told it until revision ", undoing.newest_undone,
                   " is no longer there: ", back, "tell it again with --after-revert"));
}

absl::StatusOr<OpenedSession> OpenSession(const std::string& session_id, const std::string& log,
                                          const MapView& map, GraphWriter& writer,
                                          const UndoneOptions& options) {
  const std::string& name = map.spec().name;
  OpenedSession opened{session_id, {}};
  while (true) {
    DSG_ASSIGN_OR_RETURN(opened.state, writer.GetSession(opened.session_id));
    if (opened.state.last_sequence == 0) return opened;
    DSG_ASSIGN_OR_RETURN(const std::optional<Undoing> undoing,
                         FindUndoing(map, opened.session_id, opened.state.first_revision));
    if (!undoing.has_value()) return opened;
    // A later look finds the same revert, unless another one has undone what followed it.
    absl::StrAppend(&opened.session_id, "-after-", undoing->revert.revision);
    DSG_ASSIGN_OR_RETURN(const SessionState next, writer.GetSession(opened.session_id));
    if (next.last_sequence > 0) continue;
    if (!options.is_told_again) return UndoneError(log, name, *undoing);
    if (options.has_own_ids && undoing->to >= opened.state.first_revision) {
      return PartIsLeft(log, name, opened.state.first_revision);
    }
  }
}

}  // namespace dsg::ingest
