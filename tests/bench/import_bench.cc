// SPDX-License-Identifier: Apache-2.0
// `dsg import` of W2 as the peer writes it: processor time, memory, bytes on disk.
#include <bit>
#include <filesystem>
#include <fstream>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/interop/spark_fields.h"
#include "schema/interop/spark_writer.h"
#include "schema/store/graph_store.h"
#include "tests/bench/child_process.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

using Json = nlohmann::json;

constexpr char kMap[] = "w2";
constexpr int kMeshIndexCount = 50;
constexpr double kMegabyte = 1e6;

SparkNode BareNode(const Node& from, SparkClass type, SparkLayerKey key) {
  SparkNode node;
  node.id = from.id.value;
  node.type = type;
  node.key = key;
  node.position = from.map_T_node.position;
  node.name = from.name;
  node.last_update_ns = static_cast<uint64_t>(from.last_observed_ns.value_or(0));
  if (from.class_id >= 0) node.label = static_cast<uint32_t>(from.class_id);
  return node;
}

// What the peer leaves in fields that nobody fills in: halves of addresses.
double Uninitialised(Random* random) {
  return std::bit_cast<double>(0x550000000000u + 8 * static_cast<uint64_t>(random->Index(1 << 30)));
}

SparkNode PlaceNode(const Node& from, Random* random) {
  SparkNode node = BareNode(from, SparkClass::kPlace, {3, 0});
  node.distance = from.place->clearance_m;
  node.basis_point_count = 3;
  node.fields = MakeFields(node);
  node.fields["real_place"] = true;
  for (Json& number : node.fields["frontier_scale"]) number = Uninitialised(random);
  for (Json& number : node.fields["orientation"]) number = Uninitialised(random);
  return node;
}

SparkNode ObjectNode(const Node& from) {
  SparkNode node = BareNode(from, SparkClass::kObject, {2, 0});
  node.box.type = SparkBox::Type::kAligned;
  node.box.dimensions = Eigen::Vector3f::Constant(0.5f);
  node.box.center = from.map_T_node.position.cast<float>();
  node.fields = MakeFields(node);
  const auto first = from.id.index() * kMeshIndexCount;
  for (uint64_t i = 0; i < kMeshIndexCount; ++i) {
    node.fields["mesh_connections"].push_back(first + i);
  }
  return node;
}

SparkNode PoseNode(const Node& from) {
  SparkNode node = BareNode(from, SparkClass::kAgent, {2, 97});
  node.stamp_ns = from.last_observed_ns;
  return node;
}

SparkGraph PeersW2() {
  const GraphDelta w2 = W2Graph();
  Random random(42, 0);
  SparkGraph graph;
  graph.version = kSparkVersionNewest;
  graph.layer_keys = {{2, 0}, {2, 97}, {3, 0}, {4, 0}, {5, 0}};
  for (const Node& node : w2.nodes) {
    if (node.id == W2Robot()) continue;
    switch (node.id.letter()) {
      case 'p':
        graph.nodes.push_back(PlaceNode(node, &random));
        break;
      case 'O':
        graph.nodes.push_back(ObjectNode(node));
        break;
      case 'a':
        graph.nodes.push_back(PoseNode(node));
        break;
      case 'R':
        graph.nodes.push_back(BareNode(node, SparkClass::kRoom, {4, 0}));
        break;
      default:
        graph.nodes.push_back(BareNode(node, SparkClass::kSemantic, {5, 0}));
    }
  }
  for (const Edge& edge : w2.edges) {
    graph.edges.push_back({edge.source.value, edge.target.value, false, edge.weight, ""});
  }
  return graph;
}

absl::StatusOr<int64_t> WriteFile(const std::string& path) {
  const SparkGraph graph = PeersW2();
  if (graph.nodes.size() != static_cast<size_t>(kW2NodeCount) ||
      graph.edges.size() != static_cast<size_t>(kW2EdgeCount)) {
    return absl::InternalError(absl::StrCat("made ", graph.nodes.size(), " nodes and ",
                                            graph.edges.size(), " edges, which is not W2"));
  }
  std::ofstream file(path, std::ios::binary);
  int64_t byte_count = 0;
  DSG_RETURN_IF_ERROR(WriteSpark(graph, SparkForm::kJson, [&](std::string_view bytes) {
    byte_count += static_cast<int64_t>(bytes.size());
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return absl::OkStatus();
  }));
  file.close();
  if (!file) return absl::UnavailableError(absl::StrCat(path, " cannot be written"));
  return byte_count;
}

absl::Status Run(const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "import"));
  const std::string file = folder->path() + "/w2.json";
  const std::string store = folder->path() + "/store";
  DSG_ASSIGN_OR_RETURN(const int64_t byte_count, WriteFile(file));
  report->Note(absl::StrCat(byte_count / 1'000'000, " MB of JSON"));
  DSG_ASSIGN_OR_RETURN(const Usage usage,
                       RunAndMeasure({absl::StrCat(DSG_BINARY_DIR, "/dsg"), "import", file,
                                      "--store", store, "--map", kMap, "--json"}));
  report->Line("W2 imported, processor time", "s", {static_cast<double>(usage.cpu_ns) / 1e9, {}},
               {}, {Target::Kind::kAtMost, 5.0});
  report->Line("resident memory of it", "MB",
               {static_cast<double>(usage.resident_bytes_max) / kMegabyte, {}}, {},
               {Target::Kind::kAtMost, 400.0});
  std::error_code error;
  const auto bytes = std::filesystem::file_size(store + "/" + kMap + "/graph.db", error);
  report->Line("the map's file", "MB", {static_cast<double>(bytes) / kMegabyte, {}},
               Rival{"Spark-DSG binary", {static_cast<double>(kW2PeerBytes) / kMegabyte, {}}},
               {Target::Kind::kAtMost, 45.0});
  return absl::OkStatus();
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  CLI::App app("Import of W2, 120,101 nodes and 418,099 edges, from the peer's JSON.",
               "import_bench");
  return dsg::bench::RunBenchmark(&app, argc, argv, dsg::bench::Run);
}
