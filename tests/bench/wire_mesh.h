// SPDX-License-Identifier: Apache-2.0
// How fast the mesh streams. Refuses to count a stream that has not all vertices.
#pragma once

#include "tests/bench/report.h"
#include "tests/bench/wire_client.h"

namespace dsg::bench {

/// Reads the mesh of `block_count` blocks to its end some times.
absl::Status MeasureMesh(int block_count, const WireClient& client, Report* report);

}  // namespace dsg::bench
