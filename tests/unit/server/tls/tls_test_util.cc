// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/tls/tls_test_util.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <utility>

namespace dsg::server {
namespace {

std::string TakeText(BIO* bio) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(bio, &text);
  std::string taken(text, static_cast<size_t>(size));
  BIO_free(bio);
  return taken;
}

X509* CertificateOf(const std::string& pem) {
  BIO* bio = BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  X509* read = PEM_read_bio_X509(bio, nullptr, nullptr, nullptr);
  BIO_free(bio);
  return read;
}

EVP_PKEY* KeyOf(const std::string& pem) {
  BIO* bio = BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  EVP_PKEY* read = PEM_read_bio_PrivateKey(bio, nullptr, nullptr, nullptr);
  BIO_free(bio);
  return read;
}

void AddExtension(X509* certificate, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str());
  ASSERT_NE(extension, nullptr) << value;
  X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

}  // namespace

Identity MakeIdentity(const CertificateSpec& spec, const Identity* ca) {
  static std::atomic<long> serial{1};
  EVP_PKEY* key = EVP_EC_gen("P-256");
  X509* made = X509_new();
  X509_set_version(made, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(made), serial++);
  X509_gmtime_adj(X509_getm_notBefore(made), spec.begins_s);
  X509_gmtime_adj(X509_getm_notAfter(made), spec.ends_s);
  X509_set_pubkey(made, key);
  if (!spec.common_name.empty()) {
    X509_NAME_add_entry_by_txt(X509_get_subject_name(made), "CN", MBSTRING_UTF8,
                               reinterpret_cast<const unsigned char*>(spec.common_name.c_str()), -1,
                               -1, 0);
  }
  if (spec.is_ca) AddExtension(made, NID_basic_constraints, "critical,CA:TRUE");
  if (!spec.alternative_names.empty()) {
    AddExtension(made, NID_subject_alt_name, spec.alternative_names);
  }
  X509* issuer = ca == nullptr ? nullptr : CertificateOf(ca->certificate);
  EVP_PKEY* signer = ca == nullptr ? nullptr : KeyOf(ca->key);
  X509_set_issuer_name(made, X509_get_subject_name(issuer == nullptr ? made : issuer));
  X509_sign(made, signer == nullptr ? key : signer, EVP_sha256());
  Identity identity;
  BIO* out = BIO_new(BIO_s_mem());
  PEM_write_bio_X509(out, made);
  identity.certificate = TakeText(out);
  out = BIO_new(BIO_s_mem());
  PEM_write_bio_PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr);
  identity.key = TakeText(out);
  X509_free(issuer);
  EVP_PKEY_free(signer);
  X509_free(made);
  EVP_PKEY_free(key);
  return identity;
}

TlsFolder::TlsFolder()
    : ca_(MakeIdentity({.common_name = "test CA", .is_ca = true}, nullptr)),
      server_(MakeIdentity({.common_name = "server one"}, &ca_)) {
  Write("ca.pem", ca_.certificate, 0644);
  Write("server.pem", server_.certificate, 0644);
  Write("server.key", server_.key);
}

std::string TlsFolder::Write(const std::string& name, const std::string& text, int mode) const {
  std::ofstream(path(name), std::ios::binary) << text;
  chmod(path(name).c_str(), static_cast<mode_t>(mode));
  return path(name);
}

TlsOptions TlsFolder::Options(bool mutual) const {
  return {path("server.pem"), path("server.key"), mutual ? path("ca.pem") : ""};
}

std::shared_ptr<const TlsContext> TlsFolder::Load(bool mutual, const std::string& protocol) const {
  const auto loaded =
      TlsContext::Load(Options(mutual), protocol.empty() ? std::vector<std::string>()
                                                         : std::vector<std::string>{protocol});
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? *loaded : nullptr;
}

TcpPair ConnectTcp(int buffer_bytes) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (buffer_bytes > 0) {
    for (const int fd : {listener, client}) {
      setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof(buffer_bytes));
      setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &buffer_bytes, sizeof(buffer_bytes));
    }
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  EXPECT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), length), 0);
  EXPECT_EQ(listen(listener, 1), 0);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  EXPECT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), length), 0);
  const int server = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  EXPECT_GE(server, 0);
  close(listener);
  const int yes = 1;
  for (const int fd : {client, server}) {
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
  }
  // A test that hangs fails instead.
  const timeval patience{20, 0};
  setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  setsockopt(client, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  return {client, server};
}

TlsClient::TlsClient(int fd, const ClientOptions& options)
    : fd_(fd), context_(SSL_CTX_new(TLS_client_method())) {
  // A server that closes first must not end the test.
  static const auto before = signal(SIGPIPE, SIG_IGN);
  EXPECT_NE(before, SIG_ERR);
  if (options.version_max != 0) {
    // Level 0 lets this client speak what the server must refuse.
    SSL_CTX_set_security_level(context_, 0);
    SSL_CTX_set_min_proto_version(context_, TLS1_VERSION);
    SSL_CTX_set_max_proto_version(context_, options.version_max);
  }
  if (options.ca != nullptr) {
    X509* ca = CertificateOf(options.ca->certificate);
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context_), ca);
    X509_free(ca);
    SSL_CTX_set_verify(context_, SSL_VERIFY_PEER, nullptr);
  }
  if (options.identity != nullptr) {
    X509* certificate = CertificateOf(options.identity->certificate);
    EVP_PKEY* key = KeyOf(options.identity->key);
    SSL_CTX_use_certificate(context_, certificate);
    SSL_CTX_use_PrivateKey(context_, key);
    X509_free(certificate);
    EVP_PKEY_free(key);
  }
  ssl_ = SSL_new(context_);
  if (!options.protocol.empty()) {
    std::string wire(1, static_cast<char>(options.protocol.size()));
    wire += options.protocol;
    SSL_set_alpn_protos(ssl_, reinterpret_cast<const unsigned char*>(wire.data()),
                        static_cast<unsigned>(wire.size()));
  }
  SSL_set_fd(ssl_, fd_);
}

TlsClient::~TlsClient() {
  SSL_free(ssl_);
  SSL_CTX_free(context_);
  if (fd_ >= 0) close(fd_);
}

bool TlsClient::Connect() { return SSL_connect(ssl_) == 1; }

bool TlsClient::Write(std::string_view bytes) {
  while (!bytes.empty()) {
    size_t put = 0;
    if (SSL_write_ex(ssl_, bytes.data(), bytes.size(), &put) != 1) return false;
    bytes.remove_prefix(put);
  }
  return true;
}

std::string TlsClient::ReadSome(size_t max) {
  std::string bytes(max, '\0');
  size_t got = 0;
  if (SSL_read_ex(ssl_, bytes.data(), bytes.size(), &got) != 1) got = 0;
  bytes.resize(got);
  return bytes;
}

std::string TlsClient::Read(size_t size) {
  std::string bytes;
  while (bytes.size() < size) {
    const std::string more = ReadSome(std::min<size_t>(size - bytes.size(), 1 << 16));
    if (more.empty()) break;
    bytes += more;
  }
  return bytes;
}

std::string TlsClient::ReadAll() { return Read(SIZE_MAX); }

std::string TlsClient::Exchange(const std::string& bytes, size_t chunk_max, uint64_t seed) {
  std::mt19937_64 random(seed);
  const int flags = fcntl(fd_, F_GETFL);
  fcntl(fd_, F_SETFL, flags | O_NONBLOCK);
  std::string back(bytes.size(), '\0');
  size_t sent = 0;
  size_t received = 0;
  size_t chunk = 0;
  bool is_open = true;
  while (is_open && received < bytes.size()) {
    // A chunk that did not go must be tried again as it is.
    if (chunk == 0) chunk = std::min<size_t>(1 + random() % chunk_max, bytes.size() - sent);
    size_t put = 0;
    const bool wrote = chunk > 0 && SSL_write_ex(ssl_, bytes.data() + sent, chunk, &put) == 1;
    if (wrote) chunk = 0;
    sent += put;
    size_t got = 0;
    const int result = SSL_read_ex(ssl_, back.data() + received, back.size() - received, &got);
    received += got;
    if (wrote || result == 1) continue;
    is_open = SSL_get_error(ssl_, result) == SSL_ERROR_WANT_READ;
    pollfd polled{fd_, static_cast<short>(chunk > 0 ? POLLIN | POLLOUT : POLLIN), 0};
    is_open = is_open && poll(&polled, 1, 20'000) > 0;
  }
  fcntl(fd_, F_SETFL, flags);
  back.resize(received);
  return back;
}

bool TlsClient::IsEndClean() const { return (SSL_get_shutdown(ssl_) & SSL_RECEIVED_SHUTDOWN) != 0; }

std::string TlsClient::ServerCommonName() const {
  const X509* shown = SSL_get0_peer_certificate(ssl_);
  return shown == nullptr ? "" : NameInCertificate(shown);
}

std::string TlsClient::Protocol() const {
  const unsigned char* name = nullptr;
  unsigned size = 0;
  SSL_get0_alpn_selected(ssl_, &name, &size);
  return size == 0 ? "" : std::string(reinterpret_cast<const char*>(name), size);
}

void TlsClient::Drop(bool reset) {
  const linger at_once{1, 0};
  if (reset) setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  close(std::exchange(fd_, -1));
}

PlainServer::~PlainServer() {
  for (std::thread& thread : threads_) thread.join();
}

TlsTerminator::Take PlainServer::take() {
  return [this](int fd, const std::string& client) {
    const int flags = fcntl(fd, F_GETFL);
    EXPECT_NE(flags & O_NONBLOCK, 0);
    EXPECT_NE(fcntl(fd, F_GETFD) & FD_CLOEXEC, 0);
    fcntl(fd, F_SETFL, flags & ~O_NONBLOCK);
    const std::lock_guard lock(mutex_);
    last_client_ = client;
    threads_.emplace_back([this, fd] {
      serve_(fd);
      close(fd);
    });
    ++taken_count_;
  };
}

std::string PlainServer::last_client() const {
  const std::lock_guard lock(mutex_);
  return last_client_;
}

void Echo(int fd) {
  std::vector<char> bytes(100'000);
  while (true) {
    const ssize_t got = recv(fd, bytes.data(), bytes.size(), 0);
    if (got <= 0 || !WritePlain(fd, {bytes.data(), static_cast<size_t>(got)})) return;
  }
}

std::string ReadPlain(int fd) {
  std::string all;
  std::vector<char> bytes(100'000);
  while (true) {
    const ssize_t got = recv(fd, bytes.data(), bytes.size(), 0);
    if (got <= 0) return all;
    all.append(bytes.data(), static_cast<size_t>(got));
  }
}

bool WritePlain(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t put = send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(put));
  }
  return true;
}

std::string RandomBytes(size_t size, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::string bytes(size, '\0');
  std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<char>(random()); });
  return bytes;
}

bool WaitUntil(const std::function<bool()>& is_true) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

int OpenDescriptorCount() {
  // That of the listing is among them, always.
  return static_cast<int>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                                        std::filesystem::directory_iterator()));
}

std::unique_ptr<TlsTerminator> StartTerminator(const TlsTerminatorOptions& options) {
  auto started = TlsTerminator::Start(options);
  EXPECT_TRUE(started.ok()) << started.status();
  return started.ok() ? *std::move(started) : nullptr;
}

}  // namespace dsg::server
