// SPDX-License-Identifier: Apache-2.0
#include "query/client/remote_api.h"

#include <grpcpp/channel.h>

#include "query/api/generated/remote_api.h"
#include "query/client/call.h"
#include "schema/base/status.h"

namespace dsg::client {

absl::StatusOr<std::unique_ptr<query::Api>> Connect(const std::string& address) {
  return Connect(ServerAddress{.address = address});
}

absl::StatusOr<std::unique_ptr<query::Api>> Connect(const ServerAddress& server) {
  DSG_RETURN_IF_ERROR(CheckAddress(server.address));
  return std::make_unique<query::RemoteApi<Caller>>(std::make_unique<Caller>(server));
}

}  // namespace dsg::client
