// SPDX-License-Identifier: Apache-2.0
// Shared by the tests of the server: cores that change or hold single calls, a record of what other
// threads do, a reader of a large stream, errors as a gRPC client sees them, and the memory of the
// process.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "query/api/generated/passing_api.h"
#include "query/service/service_core.h"
#include "schema/model/graph_delta.h"

namespace dsg::server {

/// Passes every call on to another core, for tests that override or count a single call.
class PassingCore : public query::PassingApi<query::ServiceCore> {
 public:
  using PassingApi::PassingApi;

  const std::string& store_folder() const override { return next()->store_folder(); }
};

/// Holds calls until the test opens it, so that the test and not a clock decides how long a call
/// runs. Shared by the test and the core, which the server owns.
class Gate {
 public:
  void Open();
  bool is_open() const;
  /// Waits until exactly `count` calls are held.
  void WaitForRunning(int count);
  /// Why the last call ended: OK if the gate was opened, otherwise its cancellation or deadline.
  absl::Status last_stop() const;

  /// Blocks until the gate is open or `call` must stop.
  absl::Status Pass(const query::CallContext& call);

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int running_count_ = 0;
  absl::Status last_stop_;
};

/// Numbers in the order in which other threads add them.
class Record {
 public:
  void Add(int number);
  /// Waits for so many numbers, and returns all. Fewer if it takes 20 s: the test fails then.
  std::vector<int> WaitFor(size_t count);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> numbers_;
};

/// The real core, except that the gate holds ListMaps.
class HeldCore final : public PassingCore {
 public:
  HeldCore(std::unique_ptr<query::ServiceCore> core, std::shared_ptr<Gate> gate);

  absl::Status ListMaps(const query::CallContext& call, const v1::ListMapsRequest& request,
                        v1::ListMapsResponse* reply) override;

 private:
  std::shared_ptr<Gate> gate_;
};

/// Blocks of MeshDelta, and vertices of each.
inline constexpr int kMeshBlockCount = 400;
inline constexpr uint32_t kMeshVertexCount = 3000;

/// A mesh of about 40 MB on the wire, 100 kB per block, that is hard to compress.
GraphDelta MeshDelta();

/// A stream of the whole mesh of test::kMap on its own connection, cancelled when destroyed.
class MeshReader {
 public:
  explicit MeshReader(const std::string& address);
  ~MeshReader();
  MeshReader(const MeshReader&) = delete;
  MeshReader& operator=(const MeshReader&) = delete;

  bool Read(v1::GetMeshResponse* reply) { return reader_->Read(reply); }
  bool Read();
  /// Reads the rest of the stream and returns its status.
  grpc::Status Finish();

 private:
  std::unique_ptr<v1::QueryService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::GetMeshResponse>> reader_;
  bool is_finished_ = false;
};

/// A channel with its own connection.
std::shared_ptr<grpc::Channel> ConnectAlone(const std::string& address);

/// The detail in the trailers of a finished call; empty if there is none or it does not parse.
v1::ErrorDetail DetailOf(const grpc::ClientContext& context);

/// Resident memory of this process in bytes, which includes clients and server.
int64_t ResidentBytes();

}  // namespace dsg::server
