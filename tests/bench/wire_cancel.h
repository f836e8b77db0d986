// SPDX-License-Identifier: Apache-2.0
// How soon the only worker of a server is free again after the caller of a long question has
// cancelled it. Refuses to measure a question that ends before it is cancelled.
#pragma once

#include "tests/bench/report.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {

/// Cancels each kind of long question `repeat_count` times, at instants spread over the first 600
/// ms of its work.
absl::Status MeasureCancels(const WirePlace& place, int repeat_count, Report* report);

}  // namespace dsg::bench
