// SPDX-License-Identifier: Apache-2.0
// Who may have changed an object, with the evidence of the map for and against each. The weights
// are in weights.h.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/hands.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/verdict.h"
#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Candidates are people with a pose in the room or within reach during the interval, those who may
/// have been within reach while nobody looked at them, whom HELD_BY edges name, robots only where a
/// NEAR edge says that a hand of theirs was at the object, and the two alternatives.
class EvidenceFinder {
 public:
  /// `all`: every change of the map, of both types, to find where things went. All must outlive
  /// this. Errors: of the snapshot.
  static absl::StatusOr<EvidenceFinder> Make(const Snapshot& snapshot, const GraphView& view,
                                             const std::vector<ObjectChange>& all);

  /// Errors: of the snapshot; what `stop` returned.
  absl::StatusOr<Verdict> Examine(const ObjectChange& change, const StopCheck& stop) const;

 private:
  EvidenceFinder(const Snapshot& snapshot, const GraphView& view,
                 const std::vector<ObjectChange>& all)
      : snapshot_(&snapshot), view_(&view), all_(&all) {}

  /// What the map says of the thing itself.
  struct Leads {
    std::vector<OtherEnd> ends;
    std::vector<Hold> holds;
  };

  /// True for those with a pose during the interval.
  absl::StatusOr<std::map<NodeId, bool>> AgentsNear(const ObjectChange& change,
                                                    const StopCheck& stop) const;
  /// nullopt: it cannot have been. Adds to `seen_s` how long it was seen within reach.
  absl::StatusOr<std::optional<Suspect>> Weigh(const ObjectChange& change, const TrackInfo& track,
                                               const Leads& leads, bool was_there,
                                               const StopCheck& stop, double* seen_s) const;
  absl::StatusOr<Suspect> WeighVisit(const ObjectChange& change, NodeId agent, const Leads& leads,
                                     Visit visit) const;
  /// Seconds of the interval in which the map's robots were elsewhere; 0 where it has none.
  absl::StatusOr<double> SecondsAway(const ObjectChange& change, const StopCheck& stop) const;
  std::vector<SameAgent> Identities(const std::vector<Suspect>& candidates) const;

  const Snapshot* snapshot_;
  const GraphView* view_;
  const std::vector<ObjectChange>* all_;
  std::map<NodeId, TrackInfo> tracks_;
};

}  // namespace dsg::query
