// SPDX-License-Identifier: Apache-2.0
// The Api of a dsg-server over gRPC: for the CLI, for ingest, and for programs of others. Says
// which addresses are understood, and bounds the channel.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "query/api/api.h"
#include "query/client/credentials.h"

namespace grpc {
class Channel;
}  // namespace grpc

namespace dsg::client {

/// Largest message in either direction, if nothing else is said.
inline constexpr int kMessageBytesMax = 4 << 20;

/// A server, and how it is called.
struct ServerAddress {
  /// "unix:/path" or "host:port".
  std::string address;
  /// Calls that change nothing are repeated a few times, and errors of the transport say how to
  /// start a server. Off for callers that repeat calls themselves and need gRPC's own words.
  bool repeats = true;
  /// The connection is kept alive between calls, so that no router on the way forgets it, and an
  /// attempt to connect may take seconds: for robots on a radio link.
  bool keeps_alive = false;
  int receive_bytes_max = kMessageBytesMax;
  /// Shown with each call; nothing for servers that do not ask.
  Credentials credentials;
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::Status CheckAddress(const std::string& address);

/// Connects lazily. Requires: CheckAddress(server.address) is OK.
std::shared_ptr<grpc::Channel> MakeChannel(const ServerAddress& server);

/// `address` is "unix:/path" or "host:port". Connects lazily; calls fail with UNAVAILABLE, naming
/// the address, while no server listens. Errors carry the server's reason and metadata.
/// Errors of the second: FIELD_INVALID for a token that would go to another machine in the clear.
absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address);
absl::StatusOr<std::unique_ptr<query::Api>> Connect(const ServerAddress& server);

}  // namespace dsg::client
