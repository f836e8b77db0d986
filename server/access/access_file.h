// SPDX-License-Identifier: Apache-2.0
// The file that says who may call a server, and how they show who they are (docs/access.md).
// Refuses to hold a token: it has their digests.
#pragma once

#include <sys/types.h>

#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/access/caller.h"

namespace dsg::server {

/// Callers by what they show. Threads: const after ReadAccessFile.
struct AccessFile {
  using ByText = std::map<std::string, std::shared_ptr<const Caller>, std::less<>>;

  /// By the SHA-256 of their token, 64 small hexadecimal digits.
  ByText by_token_sha256;
  /// By the name in their certificate.
  ByText by_certificate;
  /// By the user at the other end of a unix socket.
  std::map<uid_t, std::shared_ptr<const Caller>> by_uid;
};

/// Errors: FILE_MALFORMED with file, line and column: no YAML, unknown keys and roles, names
/// of maps that no map has, a credential that two names share, no caller at all; FIELD_INVALID
/// if the file cannot be read, is above 1 MiB, or if others than its owner can change it.
absl::StatusOr<AccessFile> ReadAccessFile(const std::string& path);

/// 64 small hexadecimal digits.
std::string Sha256OfToken(std::string_view token);

}  // namespace dsg::server
