// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/server/server_test_util.h"

#include <unistd.h>

#include <chrono>
#include <fstream>
#include <utility>

#include "dsg/v1/map_service.pb.h"
#include "grpc/grpc.h"
#include "schema/base/random.h"
#include "schema/codec/status_decode.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::server {
namespace {

// Keeps gRPC from shutting down between two tests, when no object of it is left. That shutdown
// waits ten seconds for a thread that gRPC 1.51 lets poll for a client whose socket was full.
[[maybe_unused]] const bool is_grpc_kept = [] {
  grpc_init();
  return true;
}();

}  // namespace

void Gate::Open() {
  std::lock_guard lock(mutex_);
  open_ = true;
  changed_.notify_all();
}

bool Gate::is_open() const {
  std::lock_guard lock(mutex_);
  return open_;
}

void Gate::WaitForRunning(int count) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return running_count_ == count; });
}

absl::Status Gate::last_stop() const {
  std::lock_guard lock(mutex_);
  return last_stop_;
}

absl::Status Gate::Pass(const query::CallContext& call) {
  std::unique_lock lock(mutex_);
  ++running_count_;
  changed_.notify_all();
  absl::Status stop;
  while (!open_ && stop.ok()) {
    changed_.wait_for(lock, std::chrono::milliseconds(1));
    stop = call.Check();
  }
  --running_count_;
  last_stop_ = stop;
  changed_.notify_all();
  return stop;
}

void Record::Add(int number) {
  std::lock_guard lock(mutex_);
  numbers_.push_back(number);
  changed_.notify_all();
}

std::vector<int> Record::WaitFor(size_t count) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::seconds(20), [&] { return numbers_.size() >= count; });
  return numbers_;
}

HeldCore::HeldCore(std::unique_ptr<query::ServiceCore> core, std::shared_ptr<Gate> gate)
    : PassingCore(std::move(core)), gate_(std::move(gate)) {}

absl::Status HeldCore::ListMaps(const query::CallContext& call, const v1::ListMapsRequest& request,
                                v1::ListMapsResponse* reply) {
  if (absl::Status stop = gate_->Pass(call); !stop.ok()) return stop;
  return PassingCore::ListMaps(call, request, reply);
}

GraphDelta MeshDelta() {
  GraphDelta delta;
  Random random(21, 0);
  for (int i = 0; i < kMeshBlockCount; ++i) {
    MeshBlock block;
    block.index = {i % 20, i / 20, 0};
    for (uint32_t k = 0; k < kMeshVertexCount; ++k) {
      block.positions_map.emplace_back(2.0 * block.index.x + random.Uniform(0, 2),
                                       2.0 * block.index.y + random.Uniform(0, 2),
                                       random.Uniform(0, 2));
      block.normals_map.emplace_back(random.Uniform(), random.Uniform(), random.Uniform());
      block.last_seen_ns.push_back(1'700'000'000 * kNsPerSecond + random.Index(1 << 30));
      block.first_seen_ns.push_back(block.last_seen_ns.back());
    }
    delta.mesh_blocks.push_back(std::move(block));
  }
  return delta;
}

MeshReader::MeshReader(const std::string& address)
    : stub_(v1::QueryService::NewStub(ConnectAlone(address))) {
  // Ends a test that goes wrong.
  context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  v1::GetMeshRequest request;
  request.set_map(test::kMap);
  reader_ = stub_->GetMesh(&context_, request);
}

MeshReader::~MeshReader() {
  context_.TryCancel();
  if (!is_finished_) Finish();
}

bool MeshReader::Read() {
  v1::GetMeshResponse reply;
  return Read(&reply);
}

grpc::Status MeshReader::Finish() {
  is_finished_ = true;
  while (Read()) {
  }
  return reader_->Finish();
}

std::shared_ptr<grpc::Channel> ConnectAlone(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

v1::ErrorDetail DetailOf(const grpc::ClientContext& context) {
  v1::ErrorDetail detail;
  const auto& trailers = context.GetServerTrailingMetadata();
  const auto found = trailers.find(kErrorTrailer);
  if (found != trailers.end() &&
      !detail.ParseFromString(std::string(found->second.data(), found->second.size()))) {
    detail.Clear();
  }
  return detail;
}

int64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  int64_t whole = 0;
  int64_t resident = 0;
  file >> whole >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

}  // namespace dsg::server
