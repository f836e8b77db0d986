// SPDX-License-Identifier: Apache-2.0
// Factors and shapes are kept in batches of one agent, as they were committed, which are ended
// whole: what was not meant of an ended batch is written anew. How batches are cut decides what
// counts in digests, so every backend cuts them alike.
#pragma once

#include <vector>

#include "schema/model/graph_delta.h"

namespace dsg {

/// A batch of shapes is no longer, so that a reader of an instant looks back no further.
inline constexpr TimeNs kShapeBatchNsMax = 60 * kNsPerSecond;

struct BatchTimes {
  TimeNs t0 = kTimeMax;
  TimeNs t1 = kTimeMin;
};
/// First and last time of any end of a factor.
BatchTimes TimesOf(const std::vector<PoseFactor>& factors);

/// The shapes from `first` on that make one batch: at most kShapesPerSegmentMax and
/// kShapeBatchNsMax. Requires: there is one.
ShapeAppend CutBatch(const ShapeAppend& append, size_t first);

inline bool Holds(const TrackSpan& span, TimeNs t) { return span.from_ns <= t && t < span.to_ns; }
/// All of a batch goes with the span, whatever is in it.
inline bool Covers(const TrackSpan& span, TimeNs t0, TimeNs t1) {
  return span.from_ns <= t0 && t1 < span.to_ns;
}
/// Of a batch something may lie in the span.
inline bool MayTouch(const TrackSpan& span, TimeNs t0, TimeNs t1) {
  return t0 < span.to_ns && t1 >= span.from_ns;
}
/// An end of the factor that is the span's agent's lies in it.
bool Touches(const PoseFactor& factor, const TrackSpan& span);

}  // namespace dsg
