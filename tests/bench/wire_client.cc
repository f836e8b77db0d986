// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_client.h"

#include "absl/strings/str_cat.h"

namespace dsg::bench {

absl::StatusOr<WireClient> Connect(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel =
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  if (!channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(10))) {
    return absl::UnavailableError(absl::StrCat("no server answers at ", address));
  }
  return WireClient{v1::QueryService::NewStub(channel), v1::MapService::NewStub(channel)};
}

absl::Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("call failed: ", status.error_message()));
}

}  // namespace dsg::bench
