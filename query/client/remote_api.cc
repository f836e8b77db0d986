// SPDX-License-Identifier: Apache-2.0
#include "query/client/remote_api.h"

#include <grpc/grpc.h>
#include <grpcpp/channel.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>
#include <sys/un.h>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "query/api/generated/remote_api.h"
#include "query/client/call.h"
#include "schema/base/status.h"

namespace dsg::client {
namespace {

constexpr char kUnixScheme[] = "unix:";

absl::Status BadAddress(const std::string& address, const std::string& why) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("server address \"", address, "\" ", why,
                                "; write unix:/path/to/socket or host:port"),
                   {{"field", "address"}, {"value", address}});
}

// What is sent there leaves the machine.
bool IsRemote(const std::string& address) {
  if (absl::StartsWith(address, kUnixScheme)) return false;
  const std::string host = address.substr(0, address.rfind(':'));
  return host != "localhost" && host != "[::1]" && !absl::StartsWith(host, "127.");
}

// A unix socket needs no encryption.
std::shared_ptr<grpc::ChannelCredentials> ChannelCredentialsOf(const ServerAddress& server) {
  const Credentials& own = server.credentials;
  if (!own.has_tls() || absl::StartsWith(server.address, kUnixScheme)) {
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = own.authorities_pem;
  options.pem_cert_chain = own.certificate_pem;
  options.pem_private_key = own.key_pem;
  return grpc::SslCredentials(options);
}

}  // namespace

absl::Status CheckAddress(const std::string& address) {
  if (absl::StartsWith(address, kUnixScheme)) {
    const size_t length = address.size() - (sizeof(kUnixScheme) - 1);
    if (length == 0) return BadAddress(address, "names no socket");
    if (length >= sizeof(sockaddr_un::sun_path)) {
      return BadAddress(address,
                        absl::StrCat("is longer than the ", sizeof(sockaddr_un::sun_path) - 1,
                                     " bytes that a socket's path may have"));
    }
    return absl::OkStatus();
  }
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return BadAddress(address, "has no host and port");
  int port = 0;
  if (!absl::SimpleAtoi(address.substr(colon + 1), &port) || port < 1 || port > 65535) {
    return BadAddress(address, "has no port from 1 to 65535");
  }
  return absl::OkStatus();
}

std::shared_ptr<grpc::Channel> MakeChannel(const ServerAddress& server) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(server.receive_bytes_max);
  arguments.SetMaxSendMessageSize(kMessageBytesMax);
  // Identity only: a small compressed message may otherwise unfold to any size.
  arguments.SetInt(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, 1);
  // A server that is just starting is found within the retries of one call. The minimal backoff
  // stays as it is: gRPC also gives a busy server that long to shake hands.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  // Maintenance may be silent for long; only pings tell a server at work from one that is gone.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  if (server.keeps_alive) {
    // Routers forget a connection after some minutes, some after 30 s. The server refuses pings
    // that come more often than every 10 s.
    arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
    // In spite of its name the time that one attempt to connect may take: two round trips, and the
    // first packet may be lost twice.
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
  }
  // Addresses are local sockets; neither a proxy nor a DNS record may redirect them.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_SERVICE_CONFIG_DISABLE_RESOLUTION, 1);
  return grpc::CreateCustomChannel(server.address, ChannelCredentialsOf(server), arguments);
}

absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address) {
  return Connect(ServerAddress{.address = address});
}

absl::StatusOr<std::unique_ptr<query::Api>> Connect(const ServerAddress& server) {
  DSG_RETURN_IF_ERROR(CheckAddress(server.address));
  const bool is_clear = !server.credentials.has_tls() && IsRemote(server.address);
  if (is_clear && !server.credentials.token.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("the token would be sent to ", server.address,
                                  " where everybody on the way can read it; encrypt with --tls-ca, "
                                  "or take a tunnel to a local address"),
                     {{"field", "token_file"}, {"value", server.address}});
  }
  return std::make_unique<query::RemoteApi<Caller>>(std::make_unique<Caller>(server));
}

}  // namespace dsg::client
