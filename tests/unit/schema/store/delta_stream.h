// SPDX-License-Identifier: Apache-2.0
// An endless, seeded stream of valid deltas that uses every part of the model: what is committed
// by two programs that draw the same stream must be the same map.
#pragma once

#include <cstdint>

#include "schema/model/graph_delta.h"

namespace dsg::test {

struct DeltaStreamOptions {
  uint64_t seed = 1;
  /// Of the blocks and assets that come with every few deltas.
  size_t mesh_vertex_count = 50;
  size_t asset_bytes = 2000;
  int poses_per_append = 20;
};

/// Delta number `sequence` (from 1) of the stream, for the map kMap. A pure function of its
/// arguments; valid once all deltas before it are committed.
GraphDelta DeltaOfStream(const DeltaStreamOptions& options, int64_t sequence);

}  // namespace dsg::test
