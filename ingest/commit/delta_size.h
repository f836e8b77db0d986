// SPDX-License-Identifier: Apache-2.0
// Keeps deltas small enough to commit through a server, whose messages end at 4 MiB.
#pragma once

#include <vector>

#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// Rows of one delta: 12,000 poses with covariance are about 2 MiB as a message.
inline constexpr size_t kDeltaRowsMax = 12'000;
/// Estimated bytes of one delta as a message.
inline constexpr size_t kDeltaBytesMax = size_t{3} << 20;

/// About how long the delta is as a message, a little too much rather than too little.
size_t EstimateBytes(const GraphDelta& delta);

/// Cuts a delta into ones within both limits, valid in order; the same delta gives the same
/// parts. A single mesh block, node or asset beyond the limit stays whole. Sequences are left
/// for the caller.
std::vector<GraphDelta> SplitToSize(GraphDelta delta);

/// The change in parts that a server's messages hold, for writers that cannot take it whole: nodes
/// first and together, since half of them moved would stick out of the other half. Long corrections
/// of tracks are cut too.
std::vector<GraphDelta> CutCorrection(GraphDelta delta);

}  // namespace dsg::ingest
