// SPDX-License-Identifier: Apache-2.0
// How soon a watcher of a dsg-server in its own process hears of a revision.
// Refuses to count a revision that was told out of order.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "tests/bench/keep_map.h"
#include "tests/bench/report.h"

namespace dsg::bench {

/// From the acknowledgement of a commit of 500 changes, written by this process into the folder
/// that the server serves, until the message of WatchMap is here.
absl::Status MeasureWatch(KeepMap* map, const std::string& folder, const std::string& listen,
                          int commit_count, Report* report);

}  // namespace dsg::bench
