// SPDX-License-Identifier: Apache-2.0
// Finds out who calls, from what the connection and the call show. Refuses to say what callers may
// do: their Caller does.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "server/access/access_file.h"
#include "server/access/caller.h"

namespace dsg::server {

/// What is known of the other end of a connection.
struct Peer {
  /// The user there, of a unix socket.
  std::optional<uid_t> uid;
  /// The name in its certificate, which was verified; empty without one.
  std::string certificate;
};

/// Who calls, by the access file of that generation.
struct KnownCaller {
  std::shared_ptr<const Caller> caller;
  int64_t generation = 0;
};

/// Of a connection that was accepted on a unix socket. Not for other sockets of that family: those
/// of a pair are the process's own.
Peer PeerOfUnixSocket(int fd);

/// Threads: safe from any thread.
class AccessControl {
 public:
  /// Without a file everybody may do everything.
  ///
  /// Errors: those of ReadAccessFile.
  static absl::StatusOr<std::unique_ptr<AccessControl>> Open(const std::string& path);

  /// Takes the file as it is now. Calls that have begun keep what they may.
  ///
  /// Errors: those of ReadAccessFile; then what was read before stays in force.
  absl::Status Reload();

  /// A token goes before a certificate, and a certificate before a user. The user of the server,
  /// and root, may do everything over a unix socket: they could open the maps' files.
  /// `authorization`: the field of that name; none if there is none.
  ///
  /// Errors: UNAUTHENTICATED with what to show.
  absl::StatusOr<KnownCaller> Identify(const Peer& peer,
                                       std::optional<std::string_view> authorization) const;

  /// Counts the files that were read. Who was identified by another one is to show again who it is.
  int64_t generation() const { return generation_; }

  /// Whether callers are known by certificates.
  bool names_certificates() const;
  bool asks_who() const { return !path_.empty(); }

 private:
  explicit AccessControl(std::string path) : path_(std::move(path)) {}
  std::shared_ptr<const AccessFile> file() const;
  absl::StatusOr<std::shared_ptr<const Caller>> CallerOf(
      const Peer& peer, std::optional<std::string_view> authorization) const;

  const std::string path_;
  std::atomic<int64_t> generation_{0};
  mutable std::mutex mutex_;
  /// Guarded by `mutex_`; null without a path.
  std::shared_ptr<const AccessFile> file_;
};

/// 256 random bits from the system as 43 characters of base64url.
///
/// Errors: INTERNAL with the system's reason.
absl::StatusOr<std::string> MakeToken();

/// The token of an Authorization field of the scheme Bearer; empty if it is of another one.
std::string_view BearerToken(std::string_view authorization);

}  // namespace dsg::server
