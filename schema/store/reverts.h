// SPDX-License-Identifier: Apache-2.0
// Reverts in the history of a map: how they are known, and which revisions they have undone.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "schema/model/revision.h"

namespace dsg {

/// What the id of a session begins with that goes back to the content of `revision`. A "-" follows,
/// and what tells the session from others.
std::string RevertSessionName(Revision revision);

/// The revision to which a session goes back; nullopt for sessions that are no reverts, and for
/// reverts by builds whose sessions did not name it.
std::optional<Revision> RevertedTo(std::string_view session_id);

/// A revert that has undone what a session had committed.
struct Undoing {
  RevisionInfo revert;
  Revision to = 0;
  /// The newest of the session's revisions that are undone.
  Revision newest_undone = 0;
  /// The last revision before the revert; going back to it brings back what was undone.
  Revision before = 0;
  /// Whether the session has committed after the revert: going back would undo that.
  bool has_later = false;
};

/// Finds out whether all that a session has committed is still in the head of its map.
/// The content of a revision that reverts is that of the one to which it goes back; whatever lies
/// between the two is undone, unless a later revert goes back to it.
class UndoingSearch {
 public:
  /// `is_ours`: of a session's id.
  explicit UndoingSearch(std::function<bool(const std::string&)> is_ours)
      : is_ours_(std::move(is_ours)) {}

  /// Takes the revisions of a map from its head on, newest first.
  void Take(const RevisionInfo& info);

  /// nullopt if nothing was undone of what came. Of several reverts the newest.
  const std::optional<Undoing>& found() const { return found_; }

 private:
  void TakeUndone(const RevisionInfo& info);

  std::function<bool(const std::string&)> is_ours_;
  /// The newest revert of those that came, unless what it went back to has come, too.
  RevisionInfo revert_;
  std::optional<Revision> to_;
  /// The last revision before its first part.
  Revision before_ = 0;
  bool has_kept_ours_ = false;
  std::optional<Undoing> found_;
};

}  // namespace dsg
