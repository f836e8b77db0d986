// SPDX-License-Identifier: Apache-2.0
#include "schema/store/batches.h"

#include <algorithm>

#include "schema/codec/shape_codec.h"

namespace dsg {

BatchTimes TimesOf(const std::vector<PoseFactor>& factors) {
  BatchTimes times;
  for (const PoseFactor& factor : factors) {
    times.t0 = std::min({times.t0, factor.from_ns, factor.to_ns});
    times.t1 = std::max({times.t1, factor.from_ns, factor.to_ns});
  }
  return times;
}

ShapeAppend CutBatch(const ShapeAppend& append, size_t first) {
  ShapeAppend batch{append.agent, append.topology, {}};
  const TimeNs t0 = append.shapes[first].time_ns;
  for (size_t i = first; i < append.shapes.size(); ++i) {
    const BodyShape& shape = append.shapes[i];
    // Times may lie further apart than 63 bits count.
    const uint64_t length_ns = static_cast<uint64_t>(shape.time_ns) - static_cast<uint64_t>(t0);
    if (batch.shapes.size() == kShapesPerSegmentMax ||
        length_ns > static_cast<uint64_t>(kShapeBatchNsMax)) {
      break;
    }
    batch.shapes.push_back(shape);
  }
  return batch;
}

bool Touches(const PoseFactor& factor, const TrackSpan& span) {
  const bool ends_here = factor.to_agent.empty() || factor.to_agent == span.agent;
  return Holds(span, factor.from_ns) || (ends_here && Holds(span, factor.to_ns));
}

}  // namespace dsg
