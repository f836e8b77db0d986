// SPDX-License-Identifier: Apache-2.0
// Who may have changed an object, with what the map says for and against each.
// Refuses to weigh what is not in the map; the weights are in weights.h.
#pragma once

#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/verdict.h"
#include "query/view/graph_view.h"
#include "schema/store/snapshot.h"

namespace dsg::query {

/// Candidates are people with a pose in the room or within reach during the interval, robots only
/// where a NEAR edge says that a hand of theirs was at the object, and the two alternatives.
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

  absl::StatusOr<std::vector<NodeId>> AgentsNear(const ObjectChange& change,
                                                 const StopCheck& stop) const;
  absl::StatusOr<Suspect> Weigh(const ObjectChange& change, const TrackInfo& track,
                                const std::vector<struct OtherEnd>& ends,
                                const StopCheck& stop) const;
  std::vector<SameAgent> Identities(const std::vector<Suspect>& candidates) const;

  const Snapshot* snapshot_;
  const GraphView* view_;
  const std::vector<ObjectChange>* all_;
  std::map<NodeId, TrackInfo> tracks_;
};

}  // namespace dsg::query
