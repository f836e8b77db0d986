// SPDX-License-Identifier: Apache-2.0
// What policies match in a map at one revision: nodes, spans of tracks, parts of space.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/retention/graph_index.h"
#include "schema/retention/policy.h"

namespace dsg {

/// Thinning of one track (simplify.h).
struct Thinning {
  Interval span;
  /// The ends of the span are fixed in the world, not ages: the next run has the same ends.
  bool ends_are_fixed = false;
  double position_m = 0.0;
  double rotation_rad = 0.0;
};

struct TrackChoice {
  NodeId agent;
  /// Spans of poses, shapes and factors to remove. Ascending, disjoint.
  std::vector<Interval> forgotten;
  /// Stays that end by then are removed.
  TimeNs stays_until_ns = kTimeMin;
  std::vector<Thinning> thinnings;
};

struct Selection {
  /// By index in the GraphIndex.
  std::vector<bool> is_gone;
  bool all_mesh = false;
  std::vector<Solid> solids;
  /// Ascending by agent.
  std::vector<TrackChoice> tracks;

  /// Adds what `other` selects.
  void Add(const Selection& other);
};

/// Joins intervals that touch or overlap. Order: ascending.
std::vector<Interval> JoinIntervals(std::vector<Interval> intervals);

/// What one policy matches; nothing for a history policy.
/// Errors: NOT_FOUND/NODE_UNKNOWN, LAYER_UNKNOWN.
absl::StatusOr<Selection> Select(const Snapshot& map, const GraphIndex& index,
                                 const PrunePolicy& policy, const StopCheck& stop);

/// The instant before which a policy applies, for things and for the times of an agent; nullopt for
/// policies without one, and for ages in a map without observations.
std::optional<TimeNs> CutoffOf(const PrunePolicy& policy, const WorldClock& clock);
std::optional<TimeNs> CutoffOf(const PrunePolicy& policy, const WorldClock& clock, NodeId agent);

/// Layers that a policy may touch.
class LayerSet {
 public:
  /// Errors: NOT_FOUND/LAYER_UNKNOWN.
  static absl::StatusOr<LayerSet> Of(const PrunePolicy& policy, const Snapshot& map);
  bool Holds(LayerId layer) const;

 private:
  bool is_all_ = true;
  std::vector<LayerId> layers_;
};

}  // namespace dsg
