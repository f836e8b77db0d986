// SPDX-License-Identifier: Apache-2.0
// The methods of dsg.v1 as gRPC sees them: each name begins a call. gRPC hands over bytes instead
// of messages, so that nothing is parsed before it is paid for.
#pragma once

#include <memory>

#include "grpcpp/generic/async_generic_service.h"
#include "server/call_runtime.h"

namespace dsg::server {

/// `questions` for what reads, `commits` for what writes and may wait for the disk. Both must
/// outlive the service and all calls.
std::unique_ptr<grpc::CallbackGenericService> MakeServices(CallRuntime* questions,
                                                           CallRuntime* commits);

}  // namespace dsg::server
