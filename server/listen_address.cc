// SPDX-License-Identifier: Apache-2.0
#include "server/listen_address.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

constexpr std::string_view kUnixPrefix = "unix:";

absl::Status AddressError(std::string_view text, std::string_view rule) {
  const std::string address(text);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("cannot listen on \"", address, "\": ", std::string(rule)),
                   {{"field", "listen"}, {"value", address}});
}

bool IsLoopback(const std::string& host) {
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

absl::StatusOr<ListenAddress> ParseUnix(std::string_view text) {
  ListenAddress address;
  address.socket_path = std::string(text.substr(kUnixPrefix.size()));
  if (address.socket_path.empty()) return AddressError(text, "the path is empty");
  // One byte less, for the zero that ends it.
  constexpr size_t kPathMax = sizeof(sockaddr_un::sun_path) - 1;
  if (address.socket_path.size() > kPathMax) {
    return AddressError(text, absl::StrCat("the path of a unix socket has at most ", kPathMax,
                                           " bytes; give a shorter one"));
  }
  return address;
}

}  // namespace

std::string ListenAddress::ToString() const {
  if (is_unix()) return absl::StrCat(std::string(kUnixPrefix), socket_path);
  if (host.find(':') != std::string::npos) return absl::StrCat("[", host, "]:", port);
  return absl::StrCat(host, ":", port);
}

absl::StatusOr<ListenAddress> ParseListenAddress(std::string_view text, bool allow_remote) {
  if (text.substr(0, kUnixPrefix.size()) == kUnixPrefix) return ParseUnix(text);
  const size_t colon = text.rfind(':');
  constexpr std::string_view kForm = "write unix:PATH or HOST:PORT with a port from 0 to 65535";
  if (colon == std::string_view::npos || colon == 0) return AddressError(text, kForm);
  ListenAddress address;
  address.host = std::string(text.substr(0, colon));
  if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  const std::string port(text.substr(colon + 1));
  if (!absl::SimpleAtoi(port, &address.port) || address.port < 0 || address.port > 65535) {
    return AddressError(text, kForm);
  }
  if (!allow_remote && !IsLoopback(address.host)) {
    return AddressError(text,
                        "other machines could reach it, and there is no authentication yet: "
                        "whoever connects may read and write every map. Listen on a unix socket "
                        "or 127.0.0.1, or pass --allow-remote on a network that you trust");
  }
  return address;
}

}  // namespace dsg::server
