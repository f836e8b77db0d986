// SPDX-License-Identifier: Apache-2.0
// Which spans of tracks a policy matches.
#include <map>

#include "schema/base/status.h"
#include "schema/retention/selection.h"

namespace dsg {
namespace {

absl::StatusOr<std::map<NodeId, std::vector<Interval>>> SpansInBox(const Snapshot& map,
                                                                   const Box3d& box,
                                                                   const StopCheck& stop) {
  DSG_ASSIGN_OR_RETURN(const std::vector<BoxVisit> visits,
                       map.VisitsToBox(box, kTimeMin, kTimeMax, stop));
  std::map<NodeId, std::vector<Interval>> spans;
  for (const BoxVisit& visit : visits) {
    spans[visit.agent].push_back({visit.enter_ns, visit.exit_ns});
  }
  return spans;
}

// The spans of each track that the policy names.
absl::StatusOr<std::map<NodeId, std::vector<Interval>>> SpansOf(const Snapshot& map,
                                                                const GraphIndex& index,
                                                                const PrunePolicy& policy,
                                                                const StopCheck& stop) {
  if (const auto* region = std::get_if<PrunePolicy::Region>(&policy.what)) {
    return SpansInBox(map, region->box_map, stop);
  }
  std::map<NodeId, std::vector<Interval>> spans;
  const bool is_time = std::holds_alternative<PrunePolicy::Before>(policy.what) ||
                       std::holds_alternative<PrunePolicy::OlderThan>(policy.what);
  if (!is_time && !policy.IsThinning()) return spans;
  for (const TrackInfo& track : index.tracks()) {
    Interval span;
    if (is_time) {
      const auto cutoff = CutoffOf(policy, index.clock(), track.agent);
      if (!cutoff.has_value()) return spans;
      span.to_ns = *cutoff;
    }
    spans[track.agent].push_back(span);
  }
  return spans;
}

}  // namespace

absl::Status ChooseTracks(const Snapshot& map, const GraphIndex& index, const PrunePolicy& policy,
                          const StopCheck& stop, Selection* selection) {
  DSG_ASSIGN_OR_RETURN(const auto spans_of, SpansOf(map, index, policy, stop));
  const bool is_time = std::holds_alternative<PrunePolicy::Before>(policy.what) ||
                       std::holds_alternative<PrunePolicy::OlderThan>(policy.what);
  for (const auto& [agent, spans] : spans_of) {
    TrackChoice choice;
    choice.agent = agent;
    if (policy.IsThinning()) {
      for (const Interval& span : spans) {
        choice.thinnings.push_back(
            {span, /*ends_are_fixed=*/!is_time, policy.simplify_m, policy.simplify_rad});
      }
    } else {
      choice.forgotten = JoinIntervals(spans);
      if (is_time) choice.stays_until_ns = spans.front().to_ns;
    }
    selection->tracks.push_back(std::move(choice));
  }
  return absl::OkStatus();
}

}  // namespace dsg
