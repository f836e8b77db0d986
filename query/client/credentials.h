// SPDX-License-Identifier: Apache-2.0
// How a client shows a server who it is, and how it knows the server: a token, certificates.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace dsg::client {

/// Paths; empty = none.
struct CredentialFiles {
  /// The token in its first line; only its owner may read it.
  std::string token;
  /// PEM: the authorities that vouch for the server. With it the connection is encrypted.
  std::string authorities;
  /// PEM: the client's certificate and its key, for servers that ask for one.
  std::string certificate;
  std::string key;
};

/// What those files hold.
struct Credentials {
  std::string token;
  std::string authorities_pem;
  std::string certificate_pem;
  std::string key_pem;

  bool has_tls() const { return !authorities_pem.empty(); }
};

/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the file: it cannot be read, is empty or longer
/// than 1 MiB; a token or key that others than the owner can read; a certificate without its key,
/// or without authorities.
absl::StatusOr<Credentials> ReadCredentials(const CredentialFiles& files);

}  // namespace dsg::client
