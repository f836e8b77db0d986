// SPDX-License-Identifier: Apache-2.0
// One GetTrajectory call. Between two messages it is only memory: no worker waits for a reader.
#pragma once

#include "grpcpp/grpcpp.h"
#include "server/call_runtime.h"

namespace dsg::v1 {
class GetTrajectoryRequest;
class GetTrajectoryResponse;
}  // namespace dsg::v1

namespace dsg::server {

/// What the handler returns; deletes itself. `request` belongs to gRPC and lives as long as it.
grpc::ServerWriteReactor<v1::GetTrajectoryResponse>* StartTrajectory(
    CallRuntime* runtime, grpc::CallbackServerContext* context,
    const v1::GetTrajectoryRequest* request);

}  // namespace dsg::server
