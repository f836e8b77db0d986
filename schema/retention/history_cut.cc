// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/history_cut.h"

#include <algorithm>
#include <set>

#include "schema/base/status.h"

namespace dsg {
namespace {

constexpr int kPage = 500;

// Calls `visit` for readable revisions below `before`, newest first, until it returns false.
template <class Visit>
absl::Status ForEachBefore(MapReader* reader, Revision before, const StopCheck& stop,
                           const Visit& visit) {
  while (before > 1) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> page,
                         reader->ListRevisions(before, kPage));
    if (page.empty()) return absl::OkStatus();
    for (const RevisionInfo& info : page) {
      if (!visit(info)) return absl::OkStatus();
    }
    before = page.back().revision;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<HistoryCut> FindHistoryCut(MapReader* reader, Revision newest,
                                          const PrunePolicy& policy, int64_t wall_now_ns,
                                          const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const Revision oldest, reader->OldestRevision());
  HistoryCut cut;
  cut.keep_from = newest;
  if (const auto* before = std::get_if<PrunePolicy::HistoryBefore>(&policy.what)) {
    // Gives the error for what is not there yet.
    if (before->revision > newest) DSG_RETURN_IF_ERROR(reader->At(before->revision).status());
    cut.keep_from = std::min(before->revision, newest);
  } else {
    const auto& age = std::get<PrunePolicy::HistoryOlderThan>(policy.what);
    DSG_RETURN_IF_ERROR(ForEachBefore(reader, newest + 1, stop, [&](const RevisionInfo& info) {
      if (info.committed_ns < wall_now_ns - age.age_ns || info.revision < oldest) return false;
      cut.keep_from = info.revision;
      return true;
    }));
  }
  // Nothing comes back.
  cut.keep_from = std::max(cut.keep_from, oldest);
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, reader->Tags());
  std::set<Revision> tagged;
  for (const Tag& tag : tags) tagged.insert(tag.revision);
  DSG_RETURN_IF_ERROR(ForEachBefore(reader, cut.keep_from, stop, [&](const RevisionInfo& info) {
    if (info.revision < oldest) return false;
    if (!tagged.contains(info.revision)) ++cut.revision_count;
    return true;
  }));
  return cut;
}

}  // namespace dsg
