// SPDX-License-Identifier: Apache-2.0
// Certificates made in memory, TLS clients, and plain ends that answer, for tests of the
// terminator.
#pragma once

#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/tls/tls_context.h"
#include "server/tls/tls_terminator.h"
#include "tests/support/temp_folder.h"

namespace dsg::server {

/// What a certificate says.
struct CertificateSpec {
  std::string common_name;
  /// As OpenSSL's configuration writes them: "DNS:a.example,URI:urn:x"; empty for none.
  std::string alternative_names;
  bool is_ca = false;
  /// Seconds from now.
  long begins_s = -3600;
  long ends_s = 3600;
};

/// A certificate with its key, both PEM.
struct Identity {
  std::string certificate;
  std::string key;
};

/// Signs with the key of `ca`; with its own if that is null.
Identity MakeIdentity(const CertificateSpec& spec, const Identity* ca);

/// Files of a server whose certificates one CA signs.
class TlsFolder {
 public:
  TlsFolder();
  std::string Write(const std::string& name, const std::string& text, int mode = 0600) const;
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  const Identity& ca() const { return ca_; }
  const Identity& server() const { return server_; }
  /// The server's certificate and key, and with `mutual` the CA of the clients.
  TlsOptions Options(bool mutual) const;
  std::shared_ptr<const TlsContext> Load(bool mutual, const std::string& protocol = "") const;
  Identity Client(const CertificateSpec& spec) const { return MakeIdentity(spec, &ca_); }

 private:
  test::TempFolder folder_;
  Identity ca_;
  Identity server_;
};

/// Two ends of a TCP connection on the loopback: a blocking one for the client, and a non-blocking
/// one as the acceptor makes it. Small buffers if asked for.
struct TcpPair {
  int client = -1;
  int server = -1;
};
TcpPair ConnectTcp(int buffer_bytes = 0);

struct ClientOptions {
  /// Null: shows no certificate.
  const Identity* identity = nullptr;
  /// Null: takes any certificate of the server.
  const Identity* ca = nullptr;
  int version_max = 0;
  std::string protocol;
};

/// A blocking TLS client of a socket that it owns.
class TlsClient {
 public:
  TlsClient(int fd, const ClientOptions& options);
  ~TlsClient();
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;

  /// The handshake. With TLS 1.3 it is done before the server has seen the client's certificate.
  bool Connect();
  bool Write(std::string_view bytes);
  /// Some bytes; empty at the end.
  std::string ReadSome(size_t max = 1 << 16);
  /// Exactly `size` bytes, or less at the end.
  std::string Read(size_t size);
  std::string ReadAll();
  /// Writes `bytes` in chunks of 1 to `chunk_max` and reads as many, both at the same time.
  std::string Exchange(const std::string& bytes, size_t chunk_max, uint64_t seed);
  /// True once the server has sent close_notify.
  bool IsEndClean() const;
  void EndWriting() { SSL_shutdown(ssl_); }
  std::string ServerCommonName() const;
  std::string Protocol() const;
  int fd() const { return fd_; }
  /// Closes the socket; with a reset if asked for.
  void Drop(bool reset);

 private:
  int fd_;
  SSL_CTX* context_;
  SSL* ssl_ = nullptr;
};

/// Takes plain ends: each is served by a thread of its own, in blocking mode.
class PlainServer {
 public:
  using Serve = std::function<void(int fd)>;
  /// `serve` does not close.
  explicit PlainServer(Serve serve) : serve_(std::move(serve)) {}
  ~PlainServer();

  TlsTerminator::Take take();
  int taken_count() const { return taken_count_; }
  /// The name that came with the last one.
  std::string last_client() const;

 private:
  const Serve serve_;
  std::atomic<int> taken_count_{0};
  mutable std::mutex mutex_;
  std::vector<std::thread> threads_;
  std::string last_client_;
};

/// Sends back what comes until it ends.
void Echo(int fd);
/// All bytes until the end.
std::string ReadPlain(int fd);
bool WritePlain(int fd, std::string_view bytes);

std::string RandomBytes(size_t size, uint64_t seed);
/// Waits at most ten seconds.
bool WaitUntil(const std::function<bool()>& is_true);
int OpenDescriptorCount();

std::unique_ptr<TlsTerminator> StartTerminator(const TlsTerminatorOptions& options = {});

}  // namespace dsg::server
