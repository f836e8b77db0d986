// SPDX-License-Identifier: Apache-2.0
// Whether readers that open the mesh and then do not read it slow anybody else. They are a process
// of their own, so that only the server is shared with them. Refuses to count what is sent until
// every buffer is full: that is work that was asked for.
#pragma once

#include "absl/status/status.h"
#include "tests/bench/report.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {

/// LocateAgent alone and beside such readers, in turn.
absl::Status MeasureSilentReaders(const WireServer& server, const WireClient& client,
                                  Report* report);

/// The work of the other process, for main only: nothing to do unless the first argument is the one
/// that MeasureSilentReaders gives; else opens the readers, waits to be ended, sets the exit code
/// and returns true.
bool BeSilentReaders(int argc, char** argv, int* exit_code);

}  // namespace dsg::bench
