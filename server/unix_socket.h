// SPDX-License-Identifier: Apache-2.0
// The right to listen on the path of a unix socket. What a killed server left there has to be
// removed, and this refuses to remove the socket of one that lives.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dsg::server {

/// Held while the server listens; given up when destroyed.
class UnixSocketClaim {
 public:
  /// Locks "<path>.lock" and removes a socket at `path` that nobody answers on. The lock file stays
  /// behind: removing it would let two servers lock two files of one name.
  ///
  /// Errors: UNAVAILABLE/WRITER_LOCKED when another server listens there; FIELD_INVALID when
  /// something else than a socket is at `path`, or the folder cannot be written.
  static absl::StatusOr<std::unique_ptr<UnixSocketClaim>> Take(const std::string& path);

  ~UnixSocketClaim();
  UnixSocketClaim(const UnixSocketClaim&) = delete;
  UnixSocketClaim& operator=(const UnixSocketClaim&) = delete;

 private:
  explicit UnixSocketClaim(int lock_fd) : lock_fd_(lock_fd) {}
  int lock_fd_;
};

}  // namespace dsg::server
