// SPDX-License-Identifier: Apache-2.0
// Where a server may listen. Refuses what others than this machine could reach unless told
// otherwise, because nothing authenticates callers yet.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::server {

struct ListenAddress {
  /// Set for a unix socket.
  std::string socket_path;
  /// Set otherwise. IPv6 hosts without brackets.
  std::string host;
  int port = 0;

  bool is_unix() const { return !socket_path.empty(); }
  /// As a client dials it: "unix:/run/dsg.sock", "[::1]:4410".
  std::string ToString() const;
};

/// Reads "unix:PATH" or "HOST:PORT"; port 0 takes a free one.
///
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for another form, a path too long for a socket, and for a
/// host that is not loopback unless `allow_remote`.
absl::StatusOr<ListenAddress> ParseListenAddress(std::string_view text, bool allow_remote);

}  // namespace dsg::server
