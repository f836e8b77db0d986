// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/plan.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/retention/measure.h"
#include "schema/retention/past.h"
#include "schema/retention/selection.h"

namespace dsg {
namespace {

class Planner {
 public:
  Planner(MapReader* reader, const Snapshot& map, const std::vector<PrunePolicy>& policies,
          const PlanOptions& options, const StopCheck& stop)
      : reader_(*reader), map_(map), policies_(policies), options_(options), stop_(stop) {}

  absl::StatusOr<PrunePlan> Run() {
    plan_.revision = map_.revision();
    for (const PrunePolicy& policy : policies_) DSG_RETURN_IF_ERROR(policy.Validate());
    DSG_ASSIGN_OR_RETURN(GraphIndex index, GraphIndex::Load(map_, stop_));
    DSG_RETURN_IF_ERROR(FindClock(&index));
    // The union is the last element.
    std::vector<Measured> all(policies_.size() + 1);
    all.back().selection.is_gone.assign(index.nodes().size(), false);
    for (size_t i = 0; i < policies_.size(); ++i) {
      DSG_ASSIGN_OR_RETURN(all[i].selection, SelectOf(index, policies_[i]));
      all.back().selection.Add(all[i].selection);
    }
    DSG_RETURN_IF_ERROR(Measure(map_, index, stop_, &all));
    DSG_RETURN_IF_ERROR(Report(index, all));
    DSG_RETURN_IF_ERROR(FindErasure(index, all));
    Take(index, &all.back());
    return std::move(plan_);
  }

 private:
  // The least age of all policies; nullopt without ages.
  std::optional<TimeNs> FindLeastAge() const {
    std::optional<TimeNs> least_ns;
    const auto take = [&](TimeNs age_ns) {
      least_ns = std::min(least_ns.value_or(age_ns), age_ns);
    };
    for (const PrunePolicy& policy : policies_) {
      if (const auto* old = std::get_if<PrunePolicy::OlderThan>(&policy.what)) take(old->age_ns);
      if (const auto* unseen = std::get_if<PrunePolicy::UnseenFor>(&policy.what)) {
        take(unseen->age_ns);
      }
    }
    return least_ns;
  }

  absl::Status FindClock(GraphIndex* index) {
    const std::optional<TimeNs> age_min_ns = FindLeastAge();
    if (!age_min_ns.has_value()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(WorldClock clock, FindWorldClock(&reader_, map_, *index, *age_min_ns,
                                                          options_.wall_now_ns, stop_));
    plan_.implausible_agents = clock.ahead;
    if (std::string note = NoteOf(clock); !note.empty()) plan_.notes.push_back(std::move(note));
    index->SetClock(std::move(clock));
    return absl::OkStatus();
  }

  // A node to erase may be gone already; then the past is searched for it. A policy among several
  // that names an unknown node matches nothing.
  absl::StatusOr<Selection> SelectOf(const GraphIndex& index, const PrunePolicy& policy) {
    auto selection = Select(map_, index, policy, stop_);
    if (ReasonOf(selection.status()) != Reason::kNodeUnknown) return selection;
    bool may_be_gone = policies_.size() > 1;
    if (!may_be_gone && policy.strength == PruneStrength::kErase) {
      DSG_ASSIGN_OR_RETURN(may_be_gone, WasEverThere(&reader_, map_, policy, stop_));
    }
    if (!may_be_gone) return selection;
    Selection nothing;
    nothing.is_gone.assign(index.nodes().size(), false);
    return nothing;
  }

  absl::Status Report(const GraphIndex& index, const std::vector<Measured>& all) {
    int64_t fixed_count = 0;
    int64_t pose_count = 0;
    for (const IndexedNode& node : index.nodes()) fixed_count += node.is_agent ? 0 : 1;
    for (const TrackInfo& track : index.tracks()) pose_count += track.pose_count;
    for (size_t i = 0; i < all.size(); ++i) {
      const Measured& one = all[i];
      const bool is_union = i == policies_.size();
      std::string name = is_union ? "all policies together" : policies_[i].name;
      if (name.empty()) name = absl::StrCat("policy ", i + 1);
      int64_t gone_count = 0;
      for (size_t n = 0; n < index.nodes().size(); ++n) {
        if (one.selection.is_gone[n] && !index.nodes()[n].is_agent) ++gone_count;
      }
      const bool matches_all = (fixed_count > 0 && gone_count == fixed_count) ||
                               (pose_count > 0 && one.forgotten_pose_count == pose_count) ||
                               (!is_union && TakesOnlyBuilding(index, policies_[i], one.selection));
      if (matches_all && plan_.all_matching_policy.empty()) {
        plan_.all_matching_policy = name;
      }
      const double share =
          std::max(ShareOf(gone_count, fixed_count), ShareOf(one.forgotten_pose_count, pose_count));
      if (share > plan_.share) {
        plan_.share = share;
        plan_.share_policy = name;
      }
      if (is_union) {
        const int64_t revision_count = plan_.total.revision_count;
        plan_.total = one.amount;
        plan_.total.revision_count = revision_count;
      } else {
        DSG_RETURN_IF_ERROR(ReportPolicy(policies_[i], one.amount));
      }
    }
    return absl::OkStatus();
  }

  static double ShareOf(int64_t part, int64_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
  }

  // Without its only building the rest of a map has no root.
  static bool TakesOnlyBuilding(const GraphIndex& index, const PrunePolicy& policy,
                                const Selection& selection) {
    if (!std::holds_alternative<PrunePolicy::Branch>(policy.what)) return false;
    int64_t count = 0;
    int64_t gone_count = 0;
    for (size_t n = 0; n < index.nodes().size(); ++n) {
      if (index.nodes()[n].layer != layers::kBuildings) continue;
      ++count;
      if (selection.is_gone[n]) ++gone_count;
    }
    return count > 0 && gone_count == count;
  }

  absl::Status ReportPolicy(const PrunePolicy& policy, Amount amount) {
    if (policy.IsHistory()) {
      DSG_ASSIGN_OR_RETURN(const HistoryCut cut, FindHistoryCut(&reader_, map_.revision(), policy,
                                                                options_.wall_now_ns, stop_));
      amount.revision_count = cut.revision_count;
      if (!cut.note.empty()) plan_.notes.push_back(cut.note);
      plan_.total.revision_count = std::max(plan_.total.revision_count, cut.revision_count);
      plan_.keep_from = std::max(plan_.keep_from.value_or(0), cut.keep_from);
    }
    plan_.policies.push_back({policy.name, amount});
    return absl::OkStatus();
  }

  absl::Status FindErasure(const GraphIndex& index, const std::vector<Measured>& all) {
    for (size_t i = 0; i < policies_.size(); ++i) {
      if (policies_[i].strength != PruneStrength::kErase || policies_[i].IsHistory()) continue;
      if (!plan_.erasure.has_value()) plan_.erasure.emplace();
      AddPresent(index, all[i], &*plan_.erasure);
      DSG_RETURN_IF_ERROR(AddPast(&reader_, map_, index, policies_[i], stop_, &*plan_.erasure));
    }
    if (plan_.erasure.has_value()) Normalize(&*plan_.erasure);
    return absl::OkStatus();
  }

  void Take(const GraphIndex& index, Measured* all) {
    for (uint32_t i = 0; i < index.bottom_up().size(); ++i) {
      const uint32_t at = index.bottom_up()[i];
      if (!all->selection.is_gone[at]) continue;
      const IndexedNode& node = index.nodes()[at];
      plan_.nodes.push_back({node.id, all->edge_counts[i], node.may_hold_stays, node.is_agent});
    }
    plan_.tracks = std::move(all->tracks);
    plan_.stay_removals = std::move(all->stay_removals);
    plan_.stay_edits = std::move(all->stay_edits);
    plan_.mesh = std::move(all->mesh);
  }

  MapReader& reader_;
  const Snapshot& map_;
  const std::vector<PrunePolicy>& policies_;
  const PlanOptions& options_;
  const StopCheck& stop_;
  PrunePlan plan_;
};

}  // namespace

bool PrunePlan::IsEmpty() const {
  return nodes.empty() && tracks.empty() && stay_removals.empty() && stay_edits.empty() &&
         mesh.removed.empty() && mesh.cut.empty();
}

absl::StatusOr<PrunePlan> PlanPrune(MapReader* reader, const Snapshot& map,
                                    const std::vector<PrunePolicy>& policies,
                                    const PlanOptions& options, const StopCheck& stop) {
  return Planner(reader, map, policies, options, stop).Run();
}

}  // namespace dsg
