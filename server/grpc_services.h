// SPDX-License-Identifier: Apache-2.0
// What gRPC knows of the services: their methods by name, the health of each, and, if asked for,
// reflection, by which clients without the protos find calls and messages.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "grpcpp/grpcpp.h"
#include "server/method_table.h"

namespace dsg::server {

/// Outlives the gRPC server that it is added to. Threads: const after construction.
class GrpcServices {
 public:
  /// `methods` must outlive the services and all calls.
  explicit GrpcServices(const MethodTable* methods);
  ~GrpcServices();
  GrpcServices(const GrpcServices&) = delete;
  GrpcServices& operator=(const GrpcServices&) = delete;

  /// Adds all of them to a server that is about to be built.
  void AddTo(grpc::ServerBuilder* builder, bool with_reflection);

  /// Reports each service as SERVING, beside "" for the whole server. Ends with the health
  /// service's own Shutdown.
  void ReportServing(grpc::Server* server) const;

 private:
  class NamedService;
  class UnknownMethods;

  // Full names, as "dsg.v1.QueryService"; services_ has the same order.
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<NamedService>> services_;
  const std::unique_ptr<UnknownMethods> unknown_;
};

}  // namespace dsg::server
