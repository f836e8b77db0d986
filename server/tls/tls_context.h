// SPDX-License-Identifier: Apache-2.0
// Who the server is to TLS clients, and whom it lets in: certificate, key, and the CA of clients,
// loaded from files. Refuses TLS below 1.2, a key that others can read, and an expired certificate.
#pragma once

#include <openssl/types.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::server {

/// PEM files.
struct TlsOptions {
  /// The server's certificate, then those of the CAs between it and the root.
  std::string certificate_file;
  /// The key of the certificate, without a passphrase. Only its owner may read or write the file.
  std::string key_file;
  /// The CAs whose certificates clients must show. Empty: clients are asked for none.
  std::string client_ca_file;
};

/// Immutable. To rotate certificates load again and give the new context to new connections; open
/// ones keep theirs.
///
/// Threads: safe from any thread.
class TlsContext {
 public:
  /// Loads the files. `protocols` are offered by ALPN, the preferred one first: "h2" for gRPC,
  /// "http/1.1" for the HTTP port. A client that offers only others is refused, and one that offers
  /// none goes on.
  ///
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID with the file, what is wrong with it and what to do: it
  /// cannot be read, holds no certificate or key, the key does not belong to the certificate or is
  /// open to others, a certificate is expired or not valid yet.
  static absl::StatusOr<std::shared_ptr<const TlsContext>> Load(
      const TlsOptions& options, const std::vector<std::string>& protocols);

  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

  bool requires_client_certificate() const { return requires_client_certificate_; }
  /// When the first certificate of the chain expires.
  std::chrono::system_clock::time_point expires_at() const { return expires_at_; }
  /// For SSL_new. A connection must keep the TlsContext as long as its SSL.
  SSL_CTX* get() const { return context_; }

 private:
  TlsContext() = default;
  absl::Status UseIdentity(const TlsOptions& options);
  absl::Status UseClientCa(const std::string& file);
  absl::Status OfferProtocols(const std::vector<std::string>& protocols);
  static int SelectProtocol(SSL* ssl, const unsigned char** chosen, unsigned char* chosen_size,
                            const unsigned char* offered, unsigned offered_size, void* self);

  SSL_CTX* context_ = nullptr;
  // As ALPN writes them: each after a byte with its length.
  std::string protocols_;
  bool requires_client_certificate_ = false;
  std::chrono::system_clock::time_point expires_at_;
};

/// The name that a certificate gives to its owner: the first DNS name, else the first URI, else the
/// common name; empty if there is none. Names with control characters are passed over.
std::string NameInCertificate(const X509* certificate);

/// The reason of OpenSSL's first error of this thread, which is removed with all others; empty if
/// there is none.
std::string TakeOpensslReason();

}  // namespace dsg::server
