// SPDX-License-Identifier: Apache-2.0
// The Api of a dsg-server over gRPC.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/engine/api.h"

namespace dsg::client {

/// `address` is "unix:/path" or "host:port". Connects lazily; calls fail with UNAVAILABLE, naming
/// the address, while no server listens. Errors carry the server's reason and metadata.
absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address);

}  // namespace dsg::client
