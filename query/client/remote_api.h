// SPDX-License-Identifier: Apache-2.0
// The Api of a dsg-server over gRPC: for the CLI, for ingest, and for programs of others.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/api/api.h"
#include "query/client/channel.h"

namespace dsg::client {

/// `address` is "unix:/path" or "host:port". Connects lazily; calls fail with UNAVAILABLE, naming
/// the address, while no server listens. Errors carry the server's reason and metadata.
absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address);
absl::StatusOr<std::unique_ptr<query::Api>> Connect(const ServerAddress& server);

}  // namespace dsg::client
