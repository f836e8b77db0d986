// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_mesh.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

constexpr double kMeshMbPerS = 200.0;

struct MeshRun {
  int64_t bytes = 0;
  int64_t message_count = 0;
  int64_t vertex_count = 0;
  int64_t ns = 0;
};

absl::StatusOr<MeshRun> ReadMesh(const WireClient& client, bool count_bytes) {
  MeshRun run;
  grpc::Status status;
  run.ns = NanosecondsOf([&] {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    v1::GetMeshRequest request;
    request.set_map(kWireMeshMap);
    const auto reader = client.query->GetMesh(&context, request);
    v1::GetMeshResponse reply;
    while (reader->Read(&reply)) {
      ++run.message_count;
      for (const v1::MeshBlock& block : reply.blocks()) run.vertex_count += block.colors_size();
      if (count_bytes) run.bytes += static_cast<int64_t>(reply.ByteSizeLong());
    }
    status = reader->Finish();
  });
  DSG_RETURN_IF_ERROR(FromGrpc(status));
  return run;
}

}  // namespace

absl::Status MeasureMesh(int block_count, const WireClient& client, Report* report) {
  constexpr int kRunCount = 5;
  DSG_ASSIGN_OR_RETURN(const MeshRun counted, ReadMesh(client, true));
  if (counted.vertex_count != int64_t{block_count} * kWireBlockVertexCount) {
    return absl::DataLossError("the stream has not the vertices of the mesh");
  }
  std::vector<double> speeds;
  for (int i = 0; i < kRunCount; ++i) {
    DSG_ASSIGN_OR_RETURN(const MeshRun run, ReadMesh(client, false));
    speeds.push_back(static_cast<double>(counted.bytes) * 1e3 / static_cast<double>(run.ns));
  }
  std::sort(speeds.begin(), speeds.end());
  report->Note(absl::StrCat("the mesh has ", counted.vertex_count, " vertices, ",
                            counted.bytes / 1'000'000, " MB on the wire in ", counted.message_count,
                            " messages; slowest run ", speeds.front(), " MB/s, fastest ",
                            speeds.back(), " MB/s"));
  report->Line("GetMesh, median", "MB/s", {speeds[speeds.size() / 2], {}}, {},
               {Target::Kind::kAtLeast, kMeshMbPerS});
  return absl::OkStatus();
}

}  // namespace dsg::bench
