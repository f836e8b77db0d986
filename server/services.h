// SPDX-License-Identifier: Apache-2.0
// The services of dsg.v1 as gRPC sees them: every handler only starts a call.
#pragma once

#include <memory>

#include "grpcpp/impl/codegen/service_type.h"
#include "server/call_runtime.h"

namespace dsg::server {

/// `runtime` must outlive the service.
std::unique_ptr<grpc::Service> MakeQueryService(CallRuntime* runtime);
std::unique_ptr<grpc::Service> MakeMapService(CallRuntime* runtime);
std::unique_ptr<grpc::Service> MakeIngestService(CallRuntime* runtime);
std::unique_ptr<grpc::Service> MakeMaintenanceService(CallRuntime* runtime);

}  // namespace dsg::server
