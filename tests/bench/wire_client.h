// SPDX-License-Identifier: Apache-2.0
// A client of a running dsg-server through the generated stubs alone, so that a benchmark measures
// the wire and not the client library. Refuses to retry.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "dsg/v1/map_service.grpc.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"

namespace dsg::bench {

struct WireClient {
  std::unique_ptr<v1::QueryService::Stub> query;
  std::unique_ptr<v1::MapService::Stub> map;
};

/// A connection of its own, so that threads do not share one.
/// Errors: UNAVAILABLE when nothing answers within 10 s.
absl::StatusOr<WireClient> Connect(const std::string& address);

absl::Status FromGrpc(const grpc::Status& status);

/// Makes one call with the deadline that any client should set.
template <typename Stub, typename Request, typename Reply>
grpc::Status Call(Stub* stub,
                  grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Reply*),
                  const Request& request, Reply* reply) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
  return (stub->*method)(&context, request, reply);
}

}  // namespace dsg::bench
