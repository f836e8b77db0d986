// SPDX-License-Identifier: Apache-2.0
#include "server/http/access_rules.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/access/access_control.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

std::string Lower(std::string_view text) {
  return absl::AsciiStrToLower(absl::string_view(text.data(), text.size()));
}

bool NamesPort(const std::string& host) {
  const size_t colon = host.rfind(':');
  return colon != std::string::npos && host.find(']', colon) == std::string::npos;
}

std::vector<std::string> HostsOf(const ListenAddress& address,
                                 const std::vector<std::string>& more) {
  std::vector<std::string> hosts;
  if (address.is_unix()) return hosts;
  const auto add_own = [&](const std::string& name) {
    const std::string own = absl::StrCat(name, ":", address.port);
    if (std::find(hosts.begin(), hosts.end(), own) != hosts.end()) return;
    hosts.push_back(own);
    // Clients leave out the port that HTTP has by itself.
    if (address.port == 80) hosts.push_back(name);
  };
  for (const char* name : {"localhost", "127.0.0.1", "[::1]"}) add_own(name);
  add_own(address.host.find(':') == std::string::npos
              ? Lower(address.host)
              : absl::StrCat("[", Lower(address.host), "]"));
  for (const std::string& name : more) {
    hosts.push_back(Lower(name));
    if (!NamesPort(name)) hosts.push_back(absl::StrCat(Lower(name), ":", address.port));
  }
  return hosts;
}

Refusal Refuse(int http_status, absl::StatusCode code, const std::string& message,
               std::string_view fields = "") {
  return {http_status, absl::Status(code, message), fields};
}

std::string Shown(std::string_view text) { return CutText(text, 100); }

// Takes as long for a token that begins like the right one.
bool IsSame(std::string_view shown, std::string_view token) {
  return shown.size() == token.size() &&
         CRYPTO_memcmp(shown.data(), token.data(), token.size()) == 0;
}

}  // namespace

AccessRules::AccessRules(const ListenAddress& address, const std::vector<std::string>& hosts,
                         std::string token)
    : is_unix_(address.is_unix()), hosts_(HostsOf(address, hosts)), token_(std::move(token)) {}

std::optional<Refusal> AccessRules::Check(const RequestHead& head) const {
  if (auto refusal = CheckForm(head)) return refusal;
  if (auto refusal = CheckOrigin(head)) return refusal;
  if (!head.is_call() && !head.is_file()) {
    return Refuse(405, absl::StatusCode::kUnimplemented,
                  absl::StrCat("the method is ", Shown(head.method),
                               "; calls are POST, and files GET or HEAD"),
                  "Allow: GET, HEAD, POST\r\n");
  }
  return head.is_call() ? CheckToken(head) : std::nullopt;
}

// What parsers disagree about, so that a proxy may have seen another request than this one.
std::optional<Refusal> AccessRules::CheckForm(const RequestHead& head) const {
  if (head.target.size() > kTargetBytesMax) {
    return Refuse(414, absl::StatusCode::kInvalidArgument,
                  absl::StrCat("the path has ", head.target.size(), " bytes, and at most ",
                               kTargetBytesMax, " are taken"));
  }
  for (const char* name : {"host", "content-length", "content-type", "transfer-encoding",
                           "authorization", "origin", "sec-fetch-site"}) {
    if (head.Count(name) > 1) {
      return Refuse(400, absl::StatusCode::kInvalidArgument,
                    absl::StrCat("the request has the field ", name, " twice; send it once"));
    }
  }
  const auto encoding = head.Find("transfer-encoding");
  if (encoding.has_value() && Lower(*encoding) != "chunked") {
    return Refuse(501, absl::StatusCode::kUnimplemented,
                  absl::StrCat("the Transfer-Encoding is ", Shown(*encoding),
                               "; send the body with a Content-Length, or chunked"));
  }
  if (encoding.has_value() && head.Find("content-length").has_value()) {
    return Refuse(400, absl::StatusCode::kInvalidArgument,
                  "the request has a Transfer-Encoding beside a Content-Length; send one of them");
  }
  return std::nullopt;
}

std::optional<Refusal> AccessRules::CheckOrigin(const RequestHead& head) const {
  const std::string host = Lower(head.Find("host").value_or(""));
  const bool is_ours = std::find(hosts_.begin(), hosts_.end(), host) != hosts_.end();
  // No page of a browser reaches a unix socket by itself; a proxy before it has names of its own.
  if (!is_ours && !is_unix_) {
    return Refuse(421, absl::StatusCode::kPermissionDenied,
                  absl::StrCat("the Host is \"", Shown(host), "\", and this server is ",
                               absl::StrJoin(hosts_, " or "),
                               "; use one of these, or start it "
                               "with --http-host"));
  }
  if (const auto origin = head.Find("origin"); origin.has_value()) {
    const std::string text = Lower(*origin);
    if (text != "http://" + host && text != "https://" + host) {
      return Refuse(403, absl::StatusCode::kPermissionDenied,
                    absl::StrCat("the request comes from a page of ", Shown(text),
                                 ", and only pages of this server may ask it"));
    }
  }
  const std::string_view site = head.Find("sec-fetch-site").value_or("none");
  if (site != "none" && site != "same-origin") {
    return Refuse(403, absl::StatusCode::kPermissionDenied,
                  absl::StrCat("the request comes from another site (Sec-Fetch-Site is ",
                               Shown(site), "); open this server's page itself"));
  }
  return std::nullopt;
}

std::optional<Refusal> AccessRules::CheckToken(const RequestHead& head) const {
  if (token_.empty()) return std::nullopt;
  const std::string_view shown = head.Find("authorization").value_or("");
  if (IsSame(BearerToken(shown), token_)) return std::nullopt;
  return Refuse(401, absl::StatusCode::kUnauthenticated,
                absl::StrCat(shown.empty() ? "the call shows no token" : "the token is wrong",
                             "; send \"Authorization: Bearer TOKEN\" with the token that "
                             "dsg-server printed when it started, after #token="),
                "WWW-Authenticate: Bearer\r\n");
}

}  // namespace dsg::server
