// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/history_cut.h"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/world_clock.h"

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

// Adds up the wall clock from commit to commit, backwards from now.
class AgeOfRevisions {
 public:
  explicit AgeOfRevisions(int64_t wall_now_ns) : before_ns_(wall_now_ns) {}

  /// The least that has passed since a revision, asked newest first.
  int64_t Next(const RevisionInfo& info) {
    // A stamp may be any number: the difference need not fit.
    const bool is_back = info.committed_ns > before_ns_;
    const uint64_t step_ns =
        static_cast<uint64_t>(before_ns_) - static_cast<uint64_t>(info.committed_ns);
    if (!is_back && step_ns <= static_cast<uint64_t>(kClockLeapMaxNs)) {
      age_ns_ += static_cast<int64_t>(step_ns);
    } else {
      ++leap_count_;
      leap_after_ = info.revision;
    }
    before_ns_ = info.committed_ns;
    return age_ns_;
  }

  std::string Note() const {
    if (leap_count_ == 0) return "";
    return absl::StrCat("the wall clock went back, or on by more than a week, ", leap_count_,
                        leap_count_ == 1 ? " time" : " times", ", first after revision ",
                        leap_after_, "; ages of revisions count without that");
  }

 private:
  int64_t before_ns_;
  int64_t age_ns_ = 0;
  int64_t leap_count_ = 0;
  Revision leap_after_ = 0;
};

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
    AgeOfRevisions ages(wall_now_ns);
    DSG_RETURN_IF_ERROR(ForEachBefore(reader, newest + 1, stop, [&](const RevisionInfo& info) {
      if (info.revision < oldest || ages.Next(info) > age.age_ns) return false;
      cut.keep_from = info.revision;
      return true;
    }));
    cut.note = ages.Note();
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
