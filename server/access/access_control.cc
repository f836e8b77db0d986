// SPDX-License-Identifier: Apache-2.0
#include "server/access/access_control.h"

#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

constexpr size_t kShownBytesMax = 100;

// Who could open the files of the maps without the server.
std::shared_ptr<const Caller> Keeper() {
  static const auto keeper =
      std::make_shared<const Caller>("keeper", std::vector<Grant>{{query::Role::kAdmin, {"*"}}});
  return keeper;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AccessControl>> AccessControl::Open(const std::string& path) {
  std::unique_ptr<AccessControl> control(new AccessControl(path));
  DSG_RETURN_IF_ERROR(control->Reload());
  return control;
}

absl::Status AccessControl::Reload() {
  if (!asks_who()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(AccessFile read, ReadAccessFile(path_));
  auto file = std::make_shared<const AccessFile>(std::move(read));
  std::lock_guard lock(mutex_);
  file_ = std::move(file);
  ++generation_;
  return absl::OkStatus();
}

bool AccessControl::names_certificates() const {
  const std::shared_ptr<const AccessFile> known = file();
  return known != nullptr && !known->by_certificate.empty();
}

std::shared_ptr<const AccessFile> AccessControl::file() const {
  std::lock_guard lock(mutex_);
  return file_;
}

absl::StatusOr<KnownCaller> AccessControl::Identify(
    const Peer& peer, std::optional<std::string_view> authorization) const {
  // Before the file is looked at: one that comes in between makes the caller show again.
  const int64_t generation = generation_;
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Caller> caller, CallerOf(peer, authorization));
  return KnownCaller{std::move(caller), generation};
}

absl::StatusOr<std::shared_ptr<const Caller>> AccessControl::CallerOf(
    const Peer& peer, std::optional<std::string_view> authorization) const {
  if (!asks_who()) return Caller::Anybody();
  const std::shared_ptr<const AccessFile> known = file();
  if (authorization.has_value()) {
    const std::string_view token = BearerToken(*authorization);
    // By its digest, so that the time of the search tells nothing of a token.
    const auto found = token.empty() ? known->by_token_sha256.end()
                                     : known->by_token_sha256.find(Sha256OfToken(token));
    if (found != known->by_token_sha256.end()) return found->second;
    return absl::UnauthenticatedError(
        "the token is not known to this server; show one that its access file has, as "
        "\"authorization: Bearer TOKEN\" (dsg --token-file)");
  }
  if (!peer.certificate.empty()) {
    const auto found = known->by_certificate.find(peer.certificate);
    if (found != known->by_certificate.end()) return found->second;
  }
  if (peer.uid.has_value()) {
    const auto found = known->by_uid.find(*peer.uid);
    if (found != known->by_uid.end()) return found->second;
    if (*peer.uid == geteuid() || *peer.uid == 0) return Keeper();
  }
  if (!peer.certificate.empty()) {
    return absl::UnauthenticatedError(absl::StrCat(
        "the server does not know who calls: the certificate says \"",
        CutText(peer.certificate, kShownBytesMax), "\", and its access file does not"));
  }
  return absl::UnauthenticatedError(
      "the server does not know who calls; show a token as \"authorization: Bearer TOKEN\" (dsg "
      "--token-file), or a certificate that its access file names");
}

Peer PeerOfUnixSocket(int fd) {
  ucred credentials{};
  socklen_t length = sizeof(credentials);
  Peer peer;
  if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &length) == 0) {
    peer.uid = credentials.uid;
  }
  return peer;
}

std::string_view BearerToken(std::string_view authorization) {
  constexpr std::string_view kScheme = "Bearer ";
  if (authorization.substr(0, kScheme.size()) != kScheme) return {};
  return authorization.substr(kScheme.size());
}

absl::StatusOr<std::string> MakeToken() {
  char bytes[32];
  if (getrandom(bytes, sizeof(bytes), 0) != sizeof(bytes)) {
    return absl::InternalError(
        absl::StrCat("no random bytes for the token: ", std::strerror(errno)));
  }
  return absl::WebSafeBase64Escape(absl::string_view(bytes, sizeof(bytes)));
}

}  // namespace dsg::server
