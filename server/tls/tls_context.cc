// SPDX-License-Identifier: Apache-2.0
#include "server/tls/tls_context.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "server/tls/openssl_pointer_internal.h"

namespace dsg::server {
namespace {

// Forward secrecy and authenticated encryption. No others are allowed for HTTP/2 (RFC 9113, A).
constexpr char kCiphers[] =
    "ECDHE-ECDSA-AES128-GCM-SHA256:ECDHE-RSA-AES128-GCM-SHA256:"
    "ECDHE-ECDSA-AES256-GCM-SHA384:ECDHE-RSA-AES256-GCM-SHA384:"
    "ECDHE-ECDSA-CHACHA20-POLY1305:ECDHE-RSA-CHACHA20-POLY1305";
// Fast ones; a client cannot choose an exchange that costs the server several milliseconds.
constexpr char kGroups[] = "X25519:P-256:P-384";
// 112 bits: RSA keys of 2048 bits and more, no SHA-1.
constexpr int kSecurityLevel = 2;
constexpr int kChainLengthMax = 8;
constexpr size_t kFileBytesMax = 1 << 20;

// One of the files, with what it is to be in errors.
struct PemFile {
  std::string_view field;
  std::string_view role;
  const std::string& path;
};

absl::Status FileError(const PemFile& file, const std::string& what) {
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("cannot use \"", file.path, "\" as ", std::string(file.role), ": ", what),
      {{"field", std::string(file.field)}, {"value", file.path}});
}

class OpenFile {
 public:
  // A pipe without a writer must not block the start.
  explicit OpenFile(const std::string& path)
      : fd_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)) {}
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

// The text of a file; overwritten when it is destroyed, because it may be a key.
struct PemText {
  PemText() = default;
  PemText(PemText&&) = default;
  ~PemText() { OPENSSL_cleanse(bytes.data(), bytes.size()); }

  std::vector<char> bytes;
};

absl::Status CheckIsPrivate(const PemFile& file, mode_t mode) {
  if ((mode & (S_IRWXG | S_IRWXO)) == 0) return absl::OkStatus();
  constexpr std::array<char, 8> kDigits = {'0', '1', '2', '3', '4', '5', '6', '7'};
  const std::string shown = {'0', kDigits[mode >> 6 & 7], kDigits[mode >> 3 & 7],
                             kDigits[mode & 7]};
  return FileError(
      file, absl::StrCat("its mode is ", shown,
                         ", so its group or others can use it; run chmod 600 \"", file.path, "\""));
}

// Mode and text are those of one open file, so that nobody exchanges it in between.
absl::StatusOr<PemText> ReadPem(const PemFile& file, bool is_private) {
  if (file.path.empty()) return FileError(file, "the path is empty; give the path of a PEM file");
  const OpenFile opened(file.path);
  struct stat found {};
  if (opened.fd() < 0 || fstat(opened.fd(), &found) != 0) {
    return FileError(file, absl::StrCat(std::strerror(errno),
                                        "; give the path of a PEM file that this user can read"));
  }
  if (!S_ISREG(found.st_mode)) return FileError(file, "it is no file; give the path of a PEM file");
  if (is_private) DSG_RETURN_IF_ERROR(CheckIsPrivate(file, found.st_mode));
  PemText text;
  // No growth: a vector that grows leaves copies behind.
  text.bytes.resize(kFileBytesMax);
  size_t size = 0;
  while (size < text.bytes.size()) {
    const ssize_t got = read(opened.fd(), text.bytes.data() + size, text.bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return FileError(file, absl::StrCat(std::strerror(errno), "; give another file"));
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  if (size == text.bytes.size()) {
    return FileError(file, "it is larger than 1 MiB; give a PEM file with what is needed only");
  }
  text.bytes.resize(size);
  return text;
}

BioPointer ReaderOf(const PemText& text) {
  return BioPointer(BIO_new_mem_buf(text.bytes.data(), static_cast<int>(text.bytes.size())));
}

// Without it OpenSSL asks on the terminal.
int RefusePassphrase(char*, int, int, void* asked) {
  *static_cast<bool*>(asked) = true;
  return -1;
}

std::tm UtcOf(const ASN1_TIME* time) {
  std::tm utc{};
  ASN1_TIME_to_tm(time, &utc);
  return utc;
}

std::string Shown(const ASN1_TIME* time) {
  const std::tm utc = UtcOf(time);
  std::array<char, 32> text{};
  const size_t size = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return {text.data(), size};
}

std::string SubjectOf(const X509* certificate) {
  const BioPointer out(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(out.get(), X509_get_subject_name(certificate), 0, XN_FLAG_RFC2253);
  char* text = nullptr;
  const long size = BIO_get_mem_data(out.get(), &text);
  return size > 0 ? std::string(text, static_cast<size_t>(size)) : "";
}

// The comparison gives 1 for later than now, -1 for others, 0 for what is no time.
bool IsExpired(const X509* certificate) {
  return X509_cmp_current_time(X509_get0_notAfter(certificate)) != 1;
}

absl::Status CheckIsValidNow(const PemFile& file, const X509* certificate) {
  if (IsExpired(certificate)) {
    return FileError(file,
                     absl::StrCat("the certificate of ", SubjectOf(certificate), " expired at ",
                                  Shown(X509_get0_notAfter(certificate)), "; renew it"));
  }
  if (X509_cmp_current_time(X509_get0_notBefore(certificate)) != -1) {
    return FileError(file, absl::StrCat("the certificate of ", SubjectOf(certificate),
                                        " is valid from ", Shown(X509_get0_notBefore(certificate)),
                                        "; check the clock of this machine, or wait until then"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<CertificatePointer>> ReadCertificates(const PemFile& file) {
  DSG_ASSIGN_OR_RETURN(const PemText text, ReadPem(file, false));
  const BioPointer reader = ReaderOf(text);
  std::vector<CertificatePointer> certificates;
  bool asked = false;
  ERR_clear_error();
  while (
      CertificatePointer next{PEM_read_bio_X509(reader.get(), nullptr, RefusePassphrase, &asked)}) {
    certificates.push_back(std::move(next));
  }
  const bool is_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  const std::string reason = TakeOpensslReason();
  if (!is_end) {
    return FileError(file,
                     absl::StrCat("certificate number ", certificates.size() + 1,
                                  " in it cannot be read (", reason, "); give a whole PEM file"));
  }
  if (certificates.empty()) {
    return FileError(file,
                     "there is no certificate in it; give a PEM file with -----BEGIN "
                     "CERTIFICATE-----");
  }
  return certificates;
}

absl::StatusOr<KeyPointer> ReadKey(const PemFile& file) {
  DSG_ASSIGN_OR_RETURN(const PemText text, ReadPem(file, true));
  bool asked = false;
  ERR_clear_error();
  KeyPointer key(PEM_read_bio_PrivateKey(ReaderOf(text).get(), nullptr, RefusePassphrase, &asked));
  const std::string reason = TakeOpensslReason();
  if (asked) {
    return FileError(file,
                     "it is encrypted; write it without a passphrase (openssl pkey -in OLD -out "
                     "NEW) to a file of mode 600");
  }
  if (key == nullptr) {
    return FileError(file, absl::StrCat("there is no private key in it (", reason,
                                        "); give a PEM file with -----BEGIN PRIVATE KEY-----"));
  }
  return key;
}

void Configure(SSL_CTX* context) {
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_max_proto_version(context, 0);
  SSL_CTX_set_security_level(context, kSecurityLevel);
  SSL_CTX_set_cipher_list(context, kCiphers);
  SSL_CTX_set1_groups_list(context, kGroups);
  // A session that is resumed would pass by the check of the client's certificate, and outlive a
  // rotation.
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION |
                                   SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_NO_TICKET);
  SSL_CTX_set_num_tickets(context, 0);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                SSL_MODE_RELEASE_BUFFERS | SSL_MODE_NO_AUTO_CHAIN);
  // One system call for a record, not two.
  SSL_CTX_set_read_ahead(context, 1);
  SSL_CTX_set_verify(context, SSL_VERIFY_NONE, nullptr);
  SSL_CTX_set_verify_depth(context, kChainLengthMax);
}

std::string TextOf(const ASN1_STRING* string) {
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, string);
  if (size < 0) return "";
  std::string text(reinterpret_cast<const char*>(utf8), static_cast<size_t>(size));
  OPENSSL_free(utf8);
  const bool has_control = std::any_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
  return has_control ? "" : text;
}

std::string AlternativeName(const GENERAL_NAMES* names, int type) {
  for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
    int found = 0;
    const void* value = GENERAL_NAME_get0_value(sk_GENERAL_NAME_value(names, i), &found);
    if (found != type) continue;
    std::string text = TextOf(static_cast<const ASN1_STRING*>(value));
    if (!text.empty()) return text;
  }
  return "";
}

}  // namespace

absl::StatusOr<std::shared_ptr<const TlsContext>> TlsContext::Load(
    const TlsOptions& options, const std::vector<std::string>& protocols) {
  std::shared_ptr<TlsContext> made(new TlsContext);
  ERR_clear_error();
  made->context_ = SSL_CTX_new(TLS_server_method());
  if (made->context_ == nullptr) {
    return absl::UnavailableError(absl::StrCat("cannot start TLS: ", TakeOpensslReason()));
  }
  Configure(made->context_);
  DSG_RETURN_IF_ERROR(made->OfferProtocols(protocols));
  DSG_RETURN_IF_ERROR(made->UseIdentity(options));
  if (!options.client_ca_file.empty()) {
    DSG_RETURN_IF_ERROR(made->UseClientCa(options.client_ca_file));
  }
  return made;
}

TlsContext::~TlsContext() { SSL_CTX_free(context_); }

absl::Status TlsContext::UseIdentity(const TlsOptions& options) {
  const PemFile chain_file{"tls_certificate", "the server's certificate", options.certificate_file};
  const PemFile key_file{"tls_key", "the server's key", options.key_file};
  DSG_ASSIGN_OR_RETURN(std::vector<CertificatePointer> chain, ReadCertificates(chain_file));
  DSG_ASSIGN_OR_RETURN(const KeyPointer key, ReadKey(key_file));
  expires_at_ = std::chrono::system_clock::time_point::max();
  for (const CertificatePointer& certificate : chain) {
    DSG_RETURN_IF_ERROR(CheckIsValidNow(chain_file, certificate.get()));
    std::tm utc = UtcOf(X509_get0_notAfter(certificate.get()));
    expires_at_ = std::min(expires_at_, std::chrono::system_clock::from_time_t(timegm(&utc)));
  }
  if (X509_check_private_key(chain.front().get(), key.get()) != 1) {
    ERR_clear_error();
    return FileError(key_file, absl::StrCat("the key does not belong to the certificate in \"",
                                            options.certificate_file,
                                            "\"; give the key that this certificate was made for, "
                                            "and the server's certificate first in its file"));
  }
  bool is_taken = SSL_CTX_use_certificate(context_, chain.front().get()) == 1 &&
                  SSL_CTX_use_PrivateKey(context_, key.get()) == 1;
  for (size_t i = 1; i < chain.size(); ++i) {
    is_taken = is_taken && SSL_CTX_add1_chain_cert(context_, chain[i].get()) == 1;
  }
  if (is_taken) return absl::OkStatus();
  return FileError(chain_file, absl::StrCat("OpenSSL refuses it (", TakeOpensslReason(),
                                            "); make it with an EC key of P-256 or an RSA key of "
                                            "2048 bits or more, and SHA-256"));
}

absl::Status TlsContext::UseClientCa(const std::string& path) {
  const PemFile file{"tls_client_ca", "the CA of the clients", path};
  DSG_ASSIGN_OR_RETURN(const std::vector<CertificatePointer> cas, ReadCertificates(file));
  X509_STORE* store = SSL_CTX_get_cert_store(context_);
  for (const CertificatePointer& ca : cas) {
    if (X509_check_ca(ca.get()) == 0) {
      return FileError(file, absl::StrCat("the certificate of ", SubjectOf(ca.get()),
                                          " is not that of a CA; give the CA that signs the "
                                          "clients' certificates"));
    }
    if (X509_STORE_add_cert(store, ca.get()) != 1 ||
        SSL_CTX_add_client_CA(context_, ca.get()) != 1) {
      return FileError(file, absl::StrCat("OpenSSL refuses it (", TakeOpensslReason(), ")"));
    }
  }
  // An old CA may stand beside its successor.
  if (std::all_of(cas.begin(), cas.end(), [](const auto& ca) { return IsExpired(ca.get()); })) {
    return CheckIsValidNow(file, cas.front().get());
  }
  // The file says who is trusted; a CA below a root that is not in it is enough.
  X509_STORE_set_flags(store, X509_V_FLAG_PARTIAL_CHAIN);
  SSL_CTX_set_verify(context_, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  requires_client_certificate_ = true;
  return absl::OkStatus();
}

absl::Status TlsContext::OfferProtocols(const std::vector<std::string>& protocols) {
  for (const std::string& name : protocols) {
    if (name.empty() || name.size() > 255) {
      return MakeError(Reason::kFieldInvalid,
                       absl::StrCat("cannot offer the protocol \"", name,
                                    "\" by ALPN: a name has 1 to 255 bytes, as \"h2\""),
                       {{"field", "protocols"}, {"value", name}});
    }
    protocols_.push_back(static_cast<char>(name.size()));
    protocols_.append(name);
  }
  if (!protocols_.empty()) SSL_CTX_set_alpn_select_cb(context_, &SelectProtocol, this);
  return absl::OkStatus();
}

int TlsContext::SelectProtocol(SSL*, const unsigned char** chosen, unsigned char* chosen_size,
                               const unsigned char* offered, unsigned offered_size, void* self) {
  const std::string& ours = static_cast<const TlsContext*>(self)->protocols_;
  unsigned char* found = nullptr;
  const int result = SSL_select_next_proto(
      &found, chosen_size, reinterpret_cast<const unsigned char*>(ours.data()),
      static_cast<unsigned>(ours.size()), offered, offered_size);
  if (result != OPENSSL_NPN_NEGOTIATED) return SSL_TLSEXT_ERR_ALERT_FATAL;
  *chosen = found;
  return SSL_TLSEXT_ERR_OK;
}

std::string NameInCertificate(const X509* certificate) {
  const NamesPointer names(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  if (names != nullptr) {
    for (const int type : {GEN_DNS, GEN_URI}) {
      std::string found = AlternativeName(names.get(), type);
      if (!found.empty()) return found;
    }
  }
  const X509_NAME* subject = X509_get_subject_name(certificate);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (at < 0) return "";
  return TextOf(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
}

std::string TakeOpensslReason() {
  const unsigned long first = ERR_get_error();
  ERR_clear_error();
  if (first == 0) return "";
  if (ERR_SYSTEM_ERROR(first)) return std::strerror(ERR_GET_REASON(first));
  const char* reason = ERR_reason_error_string(first);
  return reason != nullptr ? reason : absl::StrCat("OpenSSL's error ", first);
}

}  // namespace dsg::server
