// SPDX-License-Identifier: Apache-2.0
// Cuts the changes of one track into pieces. Refuses to know other tracks.
#pragma once

#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"
#include "schema/retention/plan.h"

namespace dsg {

/// Threads: one caller at a time.
class TrackBatches {
 public:
  /// `plan` must outlive this.
  TrackBatches(const Snapshot& map, const TrackPlan& plan) : map_(map), plan_(plan) {}

  /// Adds the next piece, of about `row_count_max` rows. Returns how many; 0 = nothing is left.
  absl::StatusOr<size_t> AddTo(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);

 private:
  struct Piece;
  absl::StatusOr<size_t> AddShapes(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);
  absl::StatusOr<size_t> AddFactors(size_t row_count_max, GraphDelta* delta);
  absl::StatusOr<size_t> AddPoses(size_t row_count_max, const StopCheck& stop, GraphDelta* delta);
  bool Goes(TimeNs time_ns);

  const Snapshot& map_;
  const TrackPlan& plan_;
  size_t shape_span_ = 0;
  TimeNs shapes_from_ns_ = kTimeMin;
  size_t factor_span_ = 0;
  bool poses_are_done_ = false;
  TimeNs poses_from_ns_ = kTimeMin;
  size_t next_span_ = 0;
  size_t next_thinned_ = 0;
};

}  // namespace dsg
