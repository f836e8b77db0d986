// SPDX-License-Identifier: Apache-2.0
// A dsg-server over a store of wire_world.h, on a unix socket or on TCP within this machine.
// Refuses to log, which would be measured too.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/bench/child_process.h"

namespace dsg::bench {

/// What a server serves, and where it listens: "unix:PATH" or "127.0.0.1:0" for any free port.
struct WirePlace {
  std::string store;
  std::string listen;
};

struct WireServer {
  std::unique_ptr<ChildServer> process;
  /// What a client dials.
  std::string address;
};

/// `program`: the dsg-server to start; empty for the one that was built with the benchmark.
absl::StatusOr<WireServer> StartWireServer(const WirePlace& place,
                                           const std::vector<std::string>& options = {},
                                           const std::string& program = "");

}  // namespace dsg::bench
