// SPDX-License-Identifier: Apache-2.0
#include "schema/store/reverts.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

constexpr std::string_view kPrefix = "revert-to-";

}  // namespace

std::string RevertSessionName(Revision revision) {
  return absl::StrCat(std::string(kPrefix), revision);
}

std::optional<Revision> RevertedTo(std::string_view session_id) {
  if (!session_id.starts_with(kPrefix)) return std::nullopt;
  session_id.remove_prefix(kPrefix.size());
  const std::string digits(session_id.substr(0, session_id.find('-')));
  Revision revision = 0;
  if (!absl::SimpleAtoi(digits, &revision) || revision < 0) return std::nullopt;
  return revision;
}

void UndoingSearch::Take(const RevisionInfo& info) {
  if (to_.has_value() && info.revision > *to_) return TakeUndone(info);
  if (is_ours_(info.session_id)) has_kept_ours_ = true;
  to_ = RevertedTo(info.session_id);
  revert_ = info;
  before_ = info.revision - 1;
}

void UndoingSearch::TakeUndone(const RevisionInfo& info) {
  // A large revert has several parts.
  if (info.revision == before_ && RevertedTo(info.session_id) == to_) --before_;
  if (found_.has_value() || !is_ours_(info.session_id)) return;
  found_ = Undoing{.revert = revert_,
                   .to = *to_,
                   .newest_undone = info.revision,
                   .before = before_,
                   .has_later = has_kept_ours_};
}

}  // namespace dsg
