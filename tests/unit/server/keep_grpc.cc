// SPDX-License-Identifier: Apache-2.0
// Keeps gRPC from being shut down between two tests, when no object of it is left. That shutdown
// waits ten seconds for a thread which gRPC 1.51 lets poll for a client whose socket was full.
#include "grpc/grpc.h"

namespace dsg::server {
namespace {

[[maybe_unused]] const bool kept = [] {
  grpc_init();
  return true;
}();

}  // namespace
}  // namespace dsg::server
