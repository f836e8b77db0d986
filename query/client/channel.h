// SPDX-License-Identifier: Apache-2.0
// The gRPC channel to a dsg-server: which addresses are understood, and the channel's bounds.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"

namespace grpc {
class Channel;
}  // namespace grpc

namespace dsg::client {

/// Largest message in either direction.
inline constexpr int kMessageBytesMax = 4 << 20;

/// "unix:/path" or "host:port". Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::Status CheckAddress(const std::string& address);

/// Connects lazily. Requires: CheckAddress(address) is OK.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

}  // namespace dsg::client
