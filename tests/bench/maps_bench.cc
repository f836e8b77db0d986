// SPDX-License-Identifier: Apache-2.0
// What a server takes in memory whose many maps are asked in turn: each map gets the questions
// whose answers keep the most, a search, a path and a subgraph. Refuses to count what failed.
#include <filesystem>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "grpcpp/grpcpp.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {
namespace {

struct Flags {
  int map_count = 60;
};

constexpr double kResidentMibMax = 1024.0;
constexpr double kMebibyte = 1024.0 * 1024.0;

std::string MapName(int number) { return absl::StrCat("map", number); }

absl::Status MakeMaps(int map_count, const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {.create = true}));
  DSG_RETURN_IF_ERROR(store->CreateMap({.name = MapName(0)}));
  {
    DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(MapName(0)));
    GraphDelta graph = W2Graph();
    graph.map = MapName(0);
    graph.session_id = "world";
    graph.sequence = 1;
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(graph)).status());
  }
  DSG_ASSIGN_OR_RETURN(const auto reader, store->OpenMap(MapName(0)));
  const std::string copy = folder + "/copy";
  for (int i = 1; i < map_count; ++i) {
    DSG_RETURN_IF_ERROR(reader->CopyTo(copy, {}, {}));
    DSG_RETURN_IF_ERROR(store->InstallMap(MapName(i), copy, false));
    ShowProgress(absl::StrCat("map ", i + 1, " of ", map_count, " made"));
  }
  return absl::OkStatus();
}

absl::Status Checked(const std::string& map, const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(map, ": ", status.error_message()));
}

absl::Status AskOne(v1::QueryService::Stub* stub, const std::string& map) {
  {
    v1::SearchNodesRequest request;
    request.set_map(map);
    request.set_query("object");
    request.set_page_size(1000);
    grpc::ClientContext context;
    v1::SearchNodesResponse response;
    DSG_RETURN_IF_ERROR(Checked(map, stub->SearchNodes(&context, request, &response)));
    if (response.hits().empty()) return absl::InternalError(absl::StrCat(map, ": no object found"));
  }
  {
    v1::PlanPathRequest request;
    request.set_map(map);
    request.mutable_from()->set_node("R0");
    request.mutable_to()->set_node("R1");
    grpc::ClientContext context;
    v1::PlanPathResponse response;
    DSG_RETURN_IF_ERROR(Checked(map, stub->PlanPath(&context, request, &response)));
  }
  v1::GetSubgraphRequest request;
  request.set_map(map);
  request.set_root("R0");
  request.set_depth_max(1);
  grpc::ClientContext context;
  v1::GetSubgraphResponse response;
  const auto stream = stub->GetSubgraph(&context, request);
  while (stream->Read(&response)) {
  }
  return Checked(map, stream->Finish());
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "maps"));
  // The path of a socket must be short.
  DSG_ASSIGN_OR_RETURN(const auto sockets,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-maps"));
  DSG_RETURN_IF_ERROR(MakeMaps(flags.map_count, folder->path()));
  DSG_ASSIGN_OR_RETURN(
      const WireServer server,
      StartWireServer({.store = folder->path(), .listen = "unix:" + sockets->path() + "/socket"}));
  const auto stub = v1::QueryService::NewStub(
      grpc::CreateChannel(server.address, grpc::InsecureChannelCredentials()));
  for (int i = 0; i < flags.map_count; ++i) {
    DSG_RETURN_IF_ERROR(AskOne(stub.get(), MapName(i)));
    ShowProgress(absl::StrCat("map ", i + 1, " of ", flags.map_count, " asked"));
  }
  report->Note(absl::StrCat(flags.map_count, " maps of ", kW2NodeCount, " nodes and ", kW2EdgeCount,
                            " edges, asked in turn"));
  const double resident_mib = static_cast<double>(server.process->ResidentBytesMax()) / kMebibyte;
  report->Line("resident memory of the server, at most", "MiB", {resident_mib, {}}, {},
               {Target::Kind::kAtMost, kResidentMibMax});
  return absl::OkStatus();
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("What a server takes in memory whose many maps are asked in turn");
  dsg::bench::Flags flags;
  app.add_option("--maps", flags.map_count, "Maps to make and to ask")->check(CLI::Range(1, 1000));
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
