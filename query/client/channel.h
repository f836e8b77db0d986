// SPDX-License-Identifier: Apache-2.0
// The gRPC channel to a dsg-server: which addresses are understood, and the channel's bounds.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"

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
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::Status CheckAddress(const std::string& address);

/// Connects lazily. Requires: CheckAddress(server.address) is OK.
std::shared_ptr<grpc::Channel> MakeChannel(const ServerAddress& server);

}  // namespace dsg::client
